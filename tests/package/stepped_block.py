"""A small part with two stable rests and no symmetry: quick to render and to model, also in an emulated machine."""
CELL_MM = 10
SIZE = (8, 5, 5)
# Corners of a cell's six sides, counter-clockwise from outside.
SIDES = {(1, 0, 0): [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)], (-1, 0, 0): [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
         (0, 1, 0): [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)], (0, -1, 0): [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
         (0, 0, 1): [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], (0, 0, -1): [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)]}


def is_solid(x, y, z):
    inside = all(0 <= value < limit for value, limit in zip((x, y, z), SIZE))
    return inside and (x < 3 or (y < 2 and z < 4) or (x < 6 and y < 3 and z < 2))


def write(file):
    """An OBJ in millimetres."""
    corners, faces = {}, []
    for cell in ((x, y, z) for x in range(SIZE[0]) for y in range(SIZE[1]) for z in range(SIZE[2])):
        for side, square in SIDES.items():
            if is_solid(*cell) and not is_solid(*(a + b for a, b in zip(cell, side))):
                places = [tuple(a + b for a, b in zip(cell, corner)) for corner in square]
                a, b, c, d = (corners.setdefault(place, len(corners) + 1) for place in places)
                faces += [(a, b, c), (a, c, d)]
    lines = ["v %d %d %d" % tuple(CELL_MM * value for value in place) for place in corners]
    file.write_text("\n".join([*lines, *("f %d %d %d" % face for face in faces)]) + "\n")
