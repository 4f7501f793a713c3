"""The range stage on pairs as they really are: rows that do not correspond, faint dots, depth steps, real pairs."""
import json
import math


def write_ply(file, corners, faces, grey=205):
    file.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\nproperty float x\nproperty float y\nproperty float z\n"
                    f"property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {len(faces)}\n"
                    "property list uchar int vertex_indices\nend_header\n"
                    + "".join(f"{x:g} {y:g} {z:g} {grey} {grey} {grey}\n" for x, y, z in corners)
                    + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces))
    return file


def boxes(file, *sizes):
    """Boxes given as x0, x1, y0, y1, z0, z1, mm; +Y is up."""
    corners, faces = [], []
    for x0, x1, y0, y1, z0, z1 in sizes:
        n = len(corners)
        corners += [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
        faces += [(a + n, b + n, c + n) for a, b, c in
                  ((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
                   (0, 6, 4), (1, 5, 7), (1, 7, 3))]
    return write_ply(file, corners, faces)


def block(file):
    """As plain as the D415's sheet: a block whose dots are all its detail."""
    return boxes(file, (0, 60, 0, 70, 0, 50))


def comb(file):
    """Strips of 4.5 mm, 30 px of the default rig, in front of a slab by 4 to 14 mm, upright and lying."""
    return boxes(file, (0, 70, 0, 70, 0, 30), (6, 10.5, 6, 64, 30, 34), (18, 22.5, 6, 64, 30, 38),
                 (31, 35.5, 6, 64, 30, 44), (44, 60, 8, 12.5, 30, 36), (44, 60, 22, 26.5, 30, 40),
                 (44, 60, 40, 44.5, 30, 36))


def cylinder(file, radius=25, height=70, sides=720):
    corners, faces = [], []
    for i in range(sides):
        angle = 2 * math.pi * i / sides
        corners += [(radius * math.cos(angle), y, radius * math.sin(angle)) for y in (0, height)]
    for i in range(sides):
        a, b = 2 * i, 2 * ((i + 1) % sides)
        faces += [(a, a + 1, b), (b, a + 1, b + 1), (2 * sides, a, b), (2 * sides + 1, b + 1, a + 1)]
    return write_ply(file, corners + [(0, 0, 0), (0, height, 0)], faces)


def shoot(bench, folder, *options, views=2):
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", folder, "--views", views, "--poses", 1, *options], 300,
              check=True)
    return folder


def figures(bench, kind, folder, rows_px=0.0):
    """Of bench_range, or None after a line that says why not."""
    done = bench.run([bench.bin / "bench_range", kind, folder, rows_px], 300)
    if done.returncode != 0:
        bench.line(f"{folder.name}: is matched", "yes", done.stderr.strip()[-300:], False)
        return None
    return json.loads(done.stdout)


def per_cent(share):
    return 100 * (share or 0.0)


def compare_rows(bench, name, aligned, moved, rows_px):
    """Coverage and error of a pair whose rows are off beside those of the aligned pair."""
    if not aligned or not moved:
        return
    bench.at_least(f"{name}, rows off by up to {rows_px} px: coverage by that of aligned rows", 0.97,
                   moved["coverage"] / aligned["coverage"], digits=3)
    bench.at_most(f"{name}, rows off by up to {rows_px} px: error by that of aligned rows", 1.1,
                  moved["median_px"] / aligned["median_px"], digits=3)


def rows(bench, scratch):
    for name, options in (("figurine", ()), ("workshop figurine", ("--profile", "workshop", "--true-calibration"))):
        scan = shoot(bench, scratch / name.replace(" ", "-"), *options)
        aligned = figures(bench, "scan", scan)
        for rows_px in (0.4, 1.0, 2.5):
            moved = figures(bench, "scan", scan, rows_px)
            if aligned and moved:
                compare_rows(bench, name, aligned["inner"], moved["inner"], rows_px)
                bench.at_most(f"{name}, rows off by up to {rows_px} px: depth, median, by that of aligned rows", 1.1,
                              moved["depth_median_mm"] / aligned["depth_median_mm"])
        if name == "figurine":
            done = bench.run([bench.bin / "bench_range", "scan", scan, 5.0], 300)
            is_named = done.returncode == 6 and "calibration" in done.stderr and done.stderr.count("\n") == 1
            bench.line("figurine, rows off by up to 5 px", "the calibration is refused, exit code 6",
                       f"{done.returncode}: {done.stderr.strip()}", is_named)
    if not bench.data:
        bench.line("real pairs with moved rows", "-", "not measured: the pairs are not here", None)
        return
    for name in ("teddy", "cones"):
        folder = bench.data / "middlebury_stereo" / "datasets" / name
        aligned = figures(bench, "middlebury", folder)
        for rows_px in (0.4, 1.0):
            moved = figures(bench, "middlebury", folder, rows_px)
            compare_rows(bench, name, aligned and aligned["ours"]["inner"], moved and moved["ours"]["inner"], rows_px)


def faint(bench, scratch):
    options = ("--profile", "workshop", "--true-calibration", "--with", "faint-dots", "--height-mm", 100)
    for name, make in (("block", block), ("cylinder", cylinder)):
        scan = shoot(bench, scratch / f"faint-{name}", *options, "--object", make(scratch / f"{name}.ply"))
        seen = figures(bench, "scan", scan)
        if not seen:
            continue
        inner = seen["inner"]
        bench.at_least(f"faint dots, {name}: coverage below 70 deg", 80, per_cent(inner["coverage"]), "%", digits=1)
        bench.line(f"faint dots, {name}: error by sigma", "0.85 to 1.2", f"{inner['error_by_sigma']:.2f}",
                   0.85 <= inner["error_by_sigma"] <= 1.2)
        bench.at_most(f"faint dots, {name}: more than 1 px off", 0.3, per_cent(inner["over_1px"]), "%")


def edges(bench, scratch):
    scan = shoot(bench, scratch / "comb", "--object", comb(scratch / "comb.ply"), "--height-mm", 100, views=6)
    seen = figures(bench, "scan", scan)
    if not seen:
        return
    near = seen["edges"]
    bench.at_least("comb, within 10 px of a depth step: measured", 85, per_cent(near["coverage"]), "%", digits=1)
    bench.at_most("comb, more than 2 px from a step but within 10: more than 1 px off", 0.1,
                  100 * seen["edges_wrong_beyond_2px"] / near["pixels"], "%")
    bench.at_most("comb, not seen by all three: more than 3 sigma off, most in a view", 5, seen["hidden_wrong"], "pixels",
                  digits=0)
    figurine = figures(bench, "scan", shoot(bench, scratch / "figurine-edges", views=6))
    if figurine:
        bench.at_most("figurine, not seen by all three: more than 3 sigma off, most in a view", 5,
                      figurine["hidden_wrong"], "pixels", digits=0)
    steep = figures(bench, "scan", shoot(bench, scratch / "steep", "--object", cylinder(scratch / "cylinder.ply"),
                                         "--height-mm", 86))
    if steep:
        for low, band in ((55, "60"), (60, "70"), (70, "80")):
            seen = steep["bands"].get(band, {})
            bench.at_least(f"cylinder, {low} to {band} deg of the worse camera: measured", {"60": 96, "70": 90, "80": 50}[band],
                           per_cent(seen.get("coverage")), "%", digits=1)


def pairs(bench, scratch):
    if not bench.data:
        bench.line("real pairs", "-", "not measured: the pairs are not here", None)
        return
    done = bench.run([bench.bin / "bench_d415", bench.data / "d415_ir_pair"], 300)
    if done.returncode == 0:
        ours = json.loads(done.stdout)["ours"]
        bench.at_most("D415 sheet, rms of a quadric", 0.17, ours["rms_px"], "px")
        bench.at_least("D415 sheet, coverage", 98, per_cent(ours["coverage"]), "%", digits=1)
    else:
        bench.line("D415 pair", "is matched", done.stderr.strip(), False)
    for name in ("teddy", "cones"):
        seen = figures(bench, "middlebury", bench.data / "middlebury_stereo" / "datasets" / name)
        if not seen:
            continue
        ours, other = seen["ours"], seen["hh"]
        bench.at_most(f"{name}: bad-1.0 beside MODE_HH", round(per_cent(other["bad_1"]), 2), per_cent(ours["bad_1"]), "%",
                      digits=2)
        bench.note(f"{name}: measured {per_cent(ours['coverage']):.1f} %, of it bad-1.0 "
                   f"{per_cent(ours['bad_1_of_measured']):.2f} % (HH {per_cent(other['coverage']):.1f} %, "
                   f"{per_cent(other['bad_1_of_measured']):.2f} %), median {ours['inner']['median_px']:.3f} px "
                   f"(HH {other['inner']['median_px']:.3f}), error by sigma {ours['inner']['error_by_sigma']:.2f}")


PARTS = {"rows": rows, "faint": faint, "edges": edges, "pairs": pairs}
