"""A random, repeatable choice from a list of points that includes every kind of point."""
import random


def choose(points, count, kind_of, seed):
    """All points, in order, where `count` allows; else one of each kind first, then random ones, so that a run that
    ends early has also tried all kinds."""
    points = list(points)
    if count is None or count >= len(points):
        return points
    chance = random.Random(seed)
    chance.shuffle(points)
    first = {}
    for point in points:
        first.setdefault(kind_of(point), point)
    chosen = list(first.values())
    rest = [point for point in points if first[kind_of(point)] is not point]
    return (chosen + rest)[:count]
