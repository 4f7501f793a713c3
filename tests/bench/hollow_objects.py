"""Objects with deep hollows, as PLY: blocks with pockets in several faces, cups that are no bodies of revolution."""
import math
import random

import mesh_shapes
import pierced_objects

BLOCKS, CUPS, SEED = 10, 10, 41


def pocket(cells, size, face, chance):
    """A rectangular hole into one face (axis, side), as deep as two thirds of the block and as its width allows."""
    axis, side = face
    across = [k for k in range(3) if k != axis]
    wide = [2 * (chance.randint(14, 26) // 2) for _ in across]
    wide = [min(w, size[k] - 16) for w, k in zip(wide, across)]
    deep = 2 * round(min(0.66 * size[axis], 1.6 * min(wide)) / 2)
    low, high = [0, 0, 0], [0, 0, 0]
    for w, k in zip(wide, across):
        low[k] = 2 * (chance.randint(8, max(8, size[k] - w - 8)) // 2)
        high[k] = low[k] + w
    low[axis], high[axis] = (size[axis] - deep, size[axis]) if side else (0, deep)
    return cells - pierced_objects.block(low, high)


def hollow_block(chance):
    size = [2 * chance.randint(18, 34) for _ in range(3)]
    cells = pierced_objects.block((0, 0, 0), size)
    faces = [(axis, side) for axis in range(3) for side in (0, 1)]
    for face in chance.sample(faces, chance.randint(2, 3)):
        cells = pocket(cells, size, face, chance)
    corner = [2 * chance.randint(0, 4) for _ in range(3)]  # cut off: no turn carries the block onto itself
    return cells - pierced_objects.block((0, 0, 0), [c + 10 for c in corner])


def cup(file, chance, around=160):
    """A wall around a hollow; its outline is no circle, and waves once, twice and three times."""
    outer, deep, wall = chance.uniform(22, 28), chance.uniform(34, 50), chance.uniform(4, 6)
    waves = [(n, chance.uniform(0.02, 0.06), chance.uniform(0, 2 * math.pi)) for n in (1, 2, 3)]
    flare, floor = chance.uniform(-0.1, 0.25), chance.uniform(5, 9)
    height = deep + floor
    steps = 24
    profile = [(0.05, 0.0)] + [((1 + flare * k / steps), height * k / steps) for k in range(steps + 1)]
    inner = [((1 + flare * k / steps) - wall / outer, floor + deep * k / steps) for k in range(steps, -1, -1)]
    profile += inner + [(0.05, floor)]
    vertices = []
    for r, y in profile:
        for j in range(around):
            s = 2 * math.pi * j / around
            bent = 1 + sum(size * math.cos(n * s + phase) for n, size, phase in waves)
            lean = 3.0 * (y / height) ** 2
            vertices.append((outer * r * bent * math.cos(s) + lean, y, -outer * r * bent * math.sin(s),
                             mesh_shapes.paint(0.5 * y, 7 * s)))
    faces = mesh_shapes.grid_faces(around, len(profile), False)
    for ring, is_up in ((0, False), (len(profile) - 1, True)):
        middle = len(vertices)
        vertices.append((0.0 if ring == 0 else 3.0 * (floor / height) ** 2, profile[ring][1], 0.0, 160))
        for j in range(around):
            a, b = ring * around + j, ring * around + (j + 1) % around
            faces.append((middle, a, b) if is_up else (middle, b, a))
    return mesh_shapes.write_ply(file, vertices, faces)


def all_objects(folder):
    """Name and file; the same every time."""
    chance, made = random.Random(SEED), []
    for n in range(1, max(BLOCKS, CUPS) + 1):
        if n <= BLOCKS:
            mesh = pierced_objects.mesh_of_cells(hollow_block(chance))
            made.append((f"block {n}", pierced_objects.write(folder / f"block_{n}.ply", mesh)))
        if n <= CUPS:
            made.append((f"cup {n}", cup(folder / f"cup_{n}.ply", chance)))
    return made
