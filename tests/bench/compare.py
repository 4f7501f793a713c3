"""./dev bench GROUP... --compare FILE: the figures of an earlier out/bench.json beside those of this run.

The first number of a line is compared with that of the same line then. Larger is worse where "<=" is asked and for times
and memory that are only reported; smaller is worse where ">=" is asked; what else is reported is shown and not judged.
"""
import dataclasses
import json
import re

NUMBER = re.compile(r"^(-?\d+(?:\.(\d+))?)(?:e-?\d+)?\s*([a-zA-Z%]*)")
COSTS = {"s", "ms", "min", "MB", "MiB"}
ABOUT_ITSELF = ("part ", "all parts")  # lines of the bench about its own time


@dataclasses.dataclass
class Figure:
    value: float
    step: float  # of its last printed digit
    unit: str


def figure_of(measured):
    """First number of a line, if it begins with one."""
    found = NUMBER.match(measured)
    if not found:
        return None
    return Figure(float(found[1]), 10.0 ** -len(found[2] or ""), found[3])


def direction(asked, unit):
    """1: larger is worse; -1: smaller is worse; 0: neither."""
    if asked.startswith("<="):
        return 1
    if asked.startswith(">="):
        return -1
    return 1 if asked == "reported" and unit in COSTS else 0


class Earlier:
    """`tolerance`: share by which a figure may be worse, beyond the last digit that is printed."""

    def __init__(self, path, tolerance):
        record = json.loads(path.read_text())
        self.lines = {(line["group"], line["what"]): line for line in record["lines"]}
        self.commit, self.cores = record["commit"], record["cores"]
        self.samples = (record.get("quick", False), record.get("long", False))
        self.tolerance = tolerance
        self.worse = []
        self.seen = set()

    def beside(self, line):
        """What is printed after a line of this run; remembers the line if it got worse."""
        key = line["group"], line["what"]
        before = self.lines.get(key)
        if before is None:
            return "no earlier value"
        self.seen.add(key)
        now, then = figure_of(line["measured"]), figure_of(before["measured"])
        if now is None or then is None or now.unit != then.unit or then.value == 0.0:
            return before["measured"]
        words = f"{before['measured']}, x {now.value / then.value:.2f}"
        if self.is_worse(line, now, then):
            self.worse.append(f"{line['what']}: {line['measured']}, was {before['measured']}")
            words += ", WORSE"
        return words

    def is_worse(self, line, now, then):
        if line["what"].startswith(ABOUT_ITSELF):
            return False
        loss = direction(line["asked"], now.unit) * (now.value - then.value)
        return loss > self.tolerance * abs(then.value) and loss > 1.5 * max(now.step, then.step)

    def summary(self, groups, cores, samples):
        """Lines that end the comparison. `groups`: those of which every part was to run."""
        found = [f"compared with commit {self.commit}, tolerance {100 * self.tolerance:.0f} %: {len(self.worse)} worse"]
        if (cores, samples) != (self.cores, self.samples):
            found.append(f"not alike: {self.cores} cores then, {cores} now, or --quick or --long differ")
        found += [f"worse: {words}" for words in self.worse]
        found += [f"not measured now: {what}" for group, what in self.lines
                  if group in groups and (group, what) not in self.seen]
        return found
