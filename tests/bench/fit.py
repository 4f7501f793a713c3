"""Straight lines through measured times."""
import dataclasses


@dataclasses.dataclass
class Line:
    """time = fixed + slope * x; `worst` is the largest deviation of a point, as a share of the line's time there."""
    fixed: float
    slope: float
    worst: float

    def at(self, x):
        return self.fixed + self.slope * x


def through(points):
    """The line through (x, time) with the least squares of relative deviations, so that short runs count as much as
    long ones. Needs two different x and times above 0."""
    if len({x for x, _ in points}) < 2 or any(time <= 0 for _, time in points):
        raise ValueError(f"no line through {points}")
    weights = [(x, time, 1.0 / time ** 2) for x, time in points]
    total = sum(w for *_, w in weights)
    mean_x = sum(w * x for x, _, w in weights) / total
    mean_time = sum(w * time for _, time, w in weights) / total
    slope = (sum(w * (x - mean_x) * (time - mean_time) for x, time, w in weights) /
             sum(w * (x - mean_x) ** 2 for x, _, w in weights))
    line = Line(mean_time - slope * mean_x, slope, 0.0)
    line.worst = max(abs(time - line.at(x)) / max(abs(line.at(x)), 1e-9) for x, time in points)
    return line
