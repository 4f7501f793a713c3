"""Closed meshes with shapes that the built-in figurine does not have, written as PLY (units are the shape's own), and
those of other people."""
import math

FOUND_ELSEWHERE = ("meshes/igea_tri.ply", "meshes/spot", "meshes/ycb_banana")


def write_ply(file, vertices, faces):
    """`vertices`: (x, y, z, grey); `faces`: three indices, counter-clockwise seen from outside."""
    header = ("ply\nformat ascii 1.0\n" f"element vertex {len(vertices)}\n"
              "property float x\nproperty float y\nproperty float z\n"
              "property uchar red\nproperty uchar green\nproperty uchar blue\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    rows = [f"{x:.6f} {y:.6f} {z:.6f} {grey} {grey} {grey}" for x, y, z, grey in vertices]
    file.write_text(header + "\n".join(rows + [f"3 {a} {b} {c}" for a, b, c in faces]) + "\n")
    return file


def grid_faces(around, along, close_along):
    """Two triangles for each cell of a grid that is closed around, and along if asked."""
    faces = []
    for i in range(along if close_along else along - 1):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            c, d = ((i + 1) % along) * around + j, ((i + 1) % along) * around + (j + 1) % around
            faces += [(a, b, d), (a, d, c)]
    return faces


def paint(*phases):
    """Grey of a smooth pattern, 90 to 230: cameras need something to see in plain light."""
    return int(160 + 35 * math.sin(phases[0]) + 35 * math.sin(phases[1]))


def knot(file, around=96, along=720):
    """A trefoil of a tube that is thicker on one side, so that it fits onto itself in one way only: genus 1, it hides
    parts of itself."""
    def centre(t):
        return (math.sin(t) + 2 * math.sin(2 * t), math.cos(t) - 2 * math.cos(2 * t), -1.4 * math.sin(3 * t))

    vertices = []
    for i in range(along):
        t = 2 * math.pi * i / along
        p, q = centre(t), centre(t + 1e-4)
        tangent = unit([b - a for a, b in zip(p, q)])
        side = unit(cross(tangent, unit([p[0], p[1], 0.001])))
        up = cross(side, tangent)
        for j in range(around):
            s = 2 * math.pi * j / around
            r = 0.55 + 0.04 * math.sin(12 * t) + 0.08 * math.sin(t)
            x, y, z = (p[k] + r * (math.cos(s) * side[k] + math.sin(s) * up[k]) for k in range(3))
            vertices.append((x, y, z, paint(24 * t, 3 * s)))
    return write_ply(file, vertices, [face[::-1] for face in grid_faces(around, along, True)])


def pawn(file, around=240):
    """Turned on a lathe, then given flats and grooves, and bent, so that it fits onto itself in one way only: creases,
    necks, a dome."""
    profile = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.25), (0.9, 0.35), (0.55, 0.5), (0.42, 1.2), (0.36, 1.7), (0.62, 1.82),
               (0.62, 1.95), (0.4, 2.02)]
    profile += [(0.55 * math.sin(a), 2.45 - 0.55 * math.cos(a)) for a in (0.8 + 0.13 * k for k in range(18))]
    profile.append((0.0, 3.0))

    def bent(y):
        return 0.05 * y * y

    rings = []
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        steps = max(1, round(math.hypot(r1 - r0, y1 - y0) / 0.02))
        rings += [(r0 + (r1 - r0) * k / steps, y0 + (y1 - y0) * k / steps) for k in range(steps)]
    rings = [ring for ring in rings if ring[0] > 1e-6]
    vertices = []
    for r, y in rings:
        for j in range(around):
            s = 2 * math.pi * j / around
            flat = 1.0 - 0.08 * max(0.0, math.cos(5 * s)) ** 6 * (1.0 if 0.5 < y < 1.8 else 0.0)
            vertices.append((r * flat * math.cos(s) + bent(y), y, -r * flat * math.sin(s), paint(40 * y, 9 * s)))
    faces = grid_faces(around, len(rings), False)
    bottom, top = len(vertices), len(vertices) + 1
    vertices += [(bent(rings[0][1]), rings[0][1], 0.0, 160), (bent(3.0), 3.0, 0.0, 160)]
    last = (len(rings) - 1) * around
    for j in range(around):
        following = (j + 1) % around
        faces += [(bottom, following, j), (top, last + j, last + following)]
    return write_ply(file, vertices, faces)


def unit(v):
    length = math.sqrt(sum(c * c for c in v))
    return [c / length for c in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def found_elsewhere(bench):
    """Files by name, of the data that are there."""
    def mesh_of(found):
        if found.is_file():
            return found
        return next((file for ending in ("*.obj", "*.ply") for file in sorted(found.rglob(ending))), None)

    found = {path.split("/")[-1]: mesh_of(bench.data / path)
             for path in FOUND_ELSEWHERE if bench.data and (bench.data / path).exists()}
    return {name: file for name, file in found.items() if file}
