"""The movement check on rendered views: no alarm without movement, whatever the object and the sensor. It must find
every movement that would degrade a model of the issue's accuracy."""

OBJECTS = ("figurine", "pebble")
MESHES = ("spot/spot_triangulated.obj", "igea_tri.ply")
LIMIT_S = 3600

# The smallest amount that must be found in every exposure: at full size, at a quarter of it.
FOUND = {"slipped along x, mm": (0.05, 0.2), "slipped along z, mm": (0.1, 0.5), "tipped, deg": (0.5, 1.0),
         "camera knocked, deg": (0.005, 0.02)}
# A round pebble of one uniform grey does not show these.
FOUND_ON_TEXTURE = {"turned, deg": (0.1, 0.5), "lost steps, deg": (0.1, 0.5)}


def rows(bench, scale, objects):
    done = bench.run([bench.bin / "movement_shots", scale, *objects], LIMIT_S)
    if done.returncode != 0:
        bench.note(done.stderr.strip()[-300:])
        return []
    return [line.split("\t") for line in done.stdout.splitlines()]


def smallest_found(found, what):
    """The smallest amount from which on every exposure of every object was found; None: not even the largest."""
    amounts = sorted({float(row[3]) for row in found if row[2] == what}, reverse=True)
    smallest = None
    for amount in amounts:
        if any(row[6] != "moved" for row in found if row[2] == what and float(row[3]) == amount):
            break
        smallest = amount
    return smallest


def measure_size(bench, scale, size, objects):
    seen = rows(bench, scale, objects)
    still = [row for row in seen if row[2].startswith("unmoved") and float(row[3]) < 0.01]
    alarms = sum(row[6] == "moved" for row in still)
    worst = max((float(row[4]) for row in still), default=0.0)
    bench.line(f"movement check, {size}: alarms where nothing moved", "0",
               f"{alarms} of {len(still)}, largest shift {worst:.2f} px", alarms == 0 if still else None)
    for limits, rows_of in ((FOUND, seen), (FOUND_ON_TEXTURE, [row for row in seen if row[0] != "pebble"])):
        for what, asked in limits.items():
            bench.at_most(f"movement check, {size}: smallest found, {what}", asked[0 if scale == 1 else 1],
                          smallest_found(rows_of, what) if seen else None)


def measure(bench, _scratch):
    meshes = [str(bench.data / "meshes" / name) for name in MESHES] if bench.data else []
    if not meshes:
        bench.note("movement check: no meshes beside the project, built-in objects only")
    measure_size(bench, 0.25, "a quarter of the size", [*OBJECTS, *meshes])
    if bench.long and not bench.quick:
        measure_size(bench, 1, "full size", [*OBJECTS, *meshes])
