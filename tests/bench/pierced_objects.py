"""Objects of known genus, 0 to 5, as PLY: plates on a foot with drilled holes, cups with handles, a ring."""
import itertools
import math

CELL_MM = 2.0
FINE_MM = 1.0
FINE_EXTENT_MM = math.sqrt(60**2 + 50**2 + 42**2)  # of a thin plate, which keeps its size


def block(low, high, cell_mm=CELL_MM):
    """Cells from `low` to below `high`, in mm."""
    ranges = [range(round(a / cell_mm), round(b / cell_mm)) for a, b in zip(low, high)]
    return set(itertools.product(*ranges))


def drilled(cells, x, y, radius):
    """A hole along z."""
    def is_in(cell):
        return math.hypot((cell[0] + 0.5) * CELL_MM - x, (cell[1] + 0.5) * CELL_MM - y) < radius
    return {cell for cell in cells if not is_in(cell)}


def plate(*holes):
    """60 mm wide, 70 high, 10 thick, on a foot; each hole is (x, y, radius)."""
    cells = block((0, 0, 0), (60, 70, 10))
    for x, y, radius in holes:
        cells = drilled(cells, x, y, radius)
    return cells | block((-6, 0, -26), (66, 10, 36))


def thin_plate(holes):
    """60 mm wide, 50 high, 2 thick, on a foot; holes of 3 mm in a row."""
    cells = block((0, 0, 0), (60, 50, 2), FINE_MM)
    for x in range(10, 10 * holes + 1, 10):
        cells -= block((x, 30, 0), (x + 3, 33, 2), FINE_MM)
    return cells | block((0, 0, -20), (60, 6, 22), FINE_MM)


def cup(handles):
    def ring(radius):
        return {c for c in block((-32, 0, -32), (32, 60, 32))
                if math.hypot((c[0] + 0.5) * CELL_MM, (c[2] + 0.5) * CELL_MM) < radius}
    cells = ring(26) - {c for c in ring(20) if c[1] * CELL_MM >= 8}
    for side in ((1,), (1, -1))[handles - 1]:
        arch = block((20, 14, -5), (46, 50, 5)) - block((0, 22, -5), (38, 42, 5))
        arch = {c for c in arch if math.hypot((c[0] + 0.5) * CELL_MM, (c[2] + 0.5) * CELL_MM) >= 20}
        cells |= arch if side > 0 else {(-1 - x, y, z) for x, y, z in arch}
    return cells


def faces_of(cells):
    """Squares around the cells, as corners in cell units, outwards."""
    for x, y, z in sorted(cells):
        for axis, side in itertools.product(range(3), (0, 1)):
            beside = [x, y, z]
            beside[axis] += 2 * side - 1
            if tuple(beside) in cells:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = [x, y, z]
                corner[axis] += side
                corner[u] += a
                corner[v] += b
                corners.append(tuple(corner))
            yield corners if side else corners[::-1]


def mesh_of_cells(cells, cell_mm=CELL_MM):
    places, triangles = {}, []
    for corners in faces_of(cells):
        a, b, c, d = (places.setdefault(corner, len(places)) for corner in corners)
        triangles += [(a, b, c), (a, c, d)]
    return [tuple(cell_mm * n for n in corner) for corner in places], triangles


def ring_mesh(radius=28.0, tube=11.0, around=96, across=48):
    points, triangles = [], []
    for i, j in itertools.product(range(around), range(across)):
        a, b = 2 * math.pi * i / around, 2 * math.pi * j / across
        r = radius + tube * math.cos(b)
        points.append((r * math.cos(a), tube * math.sin(b), -r * math.sin(a)))
        here, right = i * across, (i + 1) % around * across
        n = (j + 1) % across
        triangles += [(here + j, right + j, right + n), (here + j, right + n, here + n)]
    return points, triangles


def write(file, mesh):
    points, triangles = mesh
    file.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
                    f"property float z\nelement face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
                    + "".join(f"{x} {y} {z}\n" for x, y, z in points)
                    + "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles))
    return file


def all_objects():
    """Name, genus, mesh."""
    row = ((14, 54, 8), (46, 54, 8), (14, 30, 8), (46, 30, 8), (30, 42, 5))
    plates = [(f"plate with {n} holes", n, mesh_of_cells(plate(*row[:n]))) for n in range(6)]
    # Cameras 22 deg above the table see through a hole in 10 mm of plate if it is wider than 4 mm.
    fine = ("plate with a hole of 8 mm", 1, mesh_of_cells(plate((30, 44, 3.5))))
    cups = [(f"cup with {n} handles", n, mesh_of_cells(cup(n))) for n in (1, 2)]
    return [*plates, fine, *cups, ("ring", 1, ring_mesh())]


def fine_objects():
    """The same, with holes that images of half the size do not resolve."""
    return [(f"thin plate with {n} holes of 3 mm", n, mesh_of_cells(thin_plate(n), FINE_MM)) for n in (2, 5)]
