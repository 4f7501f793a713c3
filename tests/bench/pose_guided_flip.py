"""The rest that is suggested for the next pose: what it is predicted to show against what it shows, on 30 objects.

Views are made by casting rays at meshes: procedural ones, of which 16 are drawn at random, and those of other people.
"""
import json
import random

import mesh_shapes
import pierced_objects

MIN_CORRELATION, MAX_ERROR, MIN_BETTER = 0.9, 0.05, 0.3
OBJECTS, RANDOM_ONES, SEED = 30, 16, 33
NAMED = ("plate with 0 holes", "plate with 2 holes", "plate with 5 holes", "cup with 1 handles", "cup with 2 handles",
         "ring")
SIZES_MM = (80, 95, 110)
RESTS_PER_OBJECT = 6


def random_cells(chance):
    """Two to five blocks and drilled blocks that touch each other: a part without a symmetry of its own."""
    cells = set()
    for _ in range(chance.randint(2, 5)):
        size = [2 * chance.randint(4, 20) for _ in range(3)]
        low = [2 * chance.randint(-8, 8) for _ in range(3)]
        if cells:  # it begins within what is there
            inside = chance.choice(sorted(cells))
            low = [int(pierced_objects.CELL_MM) * inside[k] - chance.randrange(0, size[k], 2) for k in range(3)]
        part = pierced_objects.block(low, [a + b for a, b in zip(low, size)])
        if chance.random() < 0.4:
            part = pierced_objects.drilled(part, low[0] + size[0] / 2, low[1] + size[1] / 2, min(size[:2]) / 4)
        cells |= part
    return cells


def random_objects():
    chance = random.Random(SEED)
    return [(f"blocks {n}", pierced_objects.mesh_of_cells(random_cells(chance))) for n in range(1, RANDOM_ONES + 1)]


def objects(bench, folder):
    """Name, file, and the number of the rest on which it begins; objects of two rests begin on either."""
    shapes = [(name, pierced_objects.write(folder / f"{name.replace(' ', '_')}.ply", mesh))
              for name, _, mesh in pierced_objects.all_objects() if name in NAMED]
    shapes += [(name, pierced_objects.write(folder / f"{name.replace(' ', '_')}.ply", mesh))
               for name, mesh in random_objects()]
    shapes += [("knot", mesh_shapes.knot(folder / "knot.ply")), ("pawn", mesh_shapes.pawn(folder / "pawn.ply"))]
    shapes += mesh_shapes.found_elsewhere(bench).items()
    again = [(f"{name}, otherwise", file, 1) for name, file in reversed(shapes)]
    return ([(name, file, 0) for name, file in shapes] + again)[:OBJECTS]


def correlation(pairs):
    count = len(pairs)
    means = [sum(pair[k] for pair in pairs) / count for k in (0, 1)]
    products = [[sum((p[a] - means[a]) * (p[b] - means[b]) for p in pairs) for b in (0, 1)] for a in (0, 1)]
    spread = (products[0][0] * products[1][1]) ** 0.5
    return products[0][1] / spread if spread > 0 else 0.0


def played(bench, folder):
    """Figures of bench_guided_flip by object."""
    done = []
    count = bench.pick(OBJECTS, OBJECTS, 6)
    for number, (name, file, start) in enumerate(objects(bench, folder)[:count]):
        ran = bench.run([bench.bin / "bench_guided_flip", file, str(SIZES_MM[number % len(SIZES_MM)]), str(start)], 600)
        if ran.returncode == 0:
            done.append((name, json.loads(ran.stdout)))
        else:
            bench.line(f"{name}: is predicted", "yes", ran.stderr.strip()[-200:], False)
    return done


def gains_of(one, of_all_surface):
    """Predicted and real gain of predicted rests that the object has; of a round object with many every so manieth."""
    rests = [rest for rest in one["predicted"] if rest["is_true_rest"]]
    rests = rests[::max(1, len(rests) // RESTS_PER_OBJECT)]
    if of_all_surface:
        return [(one["unseen"] - r["unseen_after"], one["true_unseen"] - r["true_unseen_after"]) for r in rests]
    return [(r["gain"], r["true_gain"]) for r in rests]


def compare(bench, done, what, of_all_surface, is_limit):
    pairs = [pair for _, one in done for pair in gains_of(one, of_all_surface)]
    if not pairs:
        return bench.line(what, "predictions", "none", False)
    found, error = correlation(pairs), sum(abs(a - b) for a, b in pairs) / len(pairs)
    text = f"correlation {found:.3f}, mean error {100 * error:.1f} points, {len(pairs)} rests of {len(done)} objects"
    asked = f">= {MIN_CORRELATION}, <= {100 * MAX_ERROR:g}" if is_limit else "reported"
    bench.line(what, asked, text, not is_limit or (found >= MIN_CORRELATION and error <= MAX_ERROR))


def follow(bench, done):
    followed = [one["predicted"][0]["true_unseen_after"] for _, one in done if one["predicted"]]
    at_random = [sum(rest["unseen_after"] for rest in one["true_rests"]) / len(one["true_rests"])
                 for _, one in done if one["predicted"]]
    best = [min(rest["unseen_after"] for rest in one["true_rests"]) for _, one in done if one["predicted"]]
    if not followed or sum(at_random) == 0:
        return bench.line("following the suggestion", "suggestions", "none", False)
    bench.at_least("following the suggestion against a random stable rest: less stays unseen, share", MIN_BETTER,
                   1 - sum(followed) / sum(at_random))
    bench.note(f"unseen surface: before {100 * mean(one['true_unseen'] for _, one in done):.2f} %, after the suggestion "
               f"{100 * mean(followed):.2f} %, after a random rest {100 * mean(at_random):.2f} %, after the best one "
               f"there is {100 * mean(best):.2f} %; "
               f"{sum(one['predicted'][0]['is_true_rest'] for _, one in done if one['predicted'])} of {len(followed)} "
               "suggestions are stable rests of the true object")


def mean(values):
    values = list(values)
    return sum(values) / len(values)


def measure(bench, scratch):
    folder = scratch / "guided_flip"
    folder.mkdir(parents=True, exist_ok=True)
    done = played(bench, folder)
    if not done:
        return
    compare(bench, done, "predicted and real gain, as shares of all surface", True, True)
    compare(bench, done, "predicted and real gain, as shares of the unseen surface", False, False)
    follow(bench, done)
    slowest = max(done, key=lambda named: named[1]["seconds"])
    bench.at_most("prediction of all rests, slowest object", 0.75, slowest[1]["seconds"], "s", 2)
