"""What each effect of the workshop costs: the same scan without it."""
import shutil

import real_rig_scans

FAMILIES = ("optics", "sensor", "projector", "materials", "turntable", "room")
EFFECTS = ("blur", "astigmatism", "lens-pair", "focus", "chromatic", "distortion", "vignetting", "gain", "prnu", "columns",
           "hot-pixels", "black-level", "cross-talk", "falloff", "flash", "contrast", "rounding", "interreflection", "gloss",
           "runout", "wobble", "worm", "tilt", "height", "folds", "screen-shadow", "table-gloss", "flicker")
# The exact calibration, so that what an effect costs is not hidden by what a calibration makes of it.
SCAN = ["--scale", 0.5, "--poses", 1, "--views", 8, "--true-calibration"]


def figures(bench, scratch, options):
    """Median and p95, um, and share within 0.15 mm, %; or None and why there is no model."""
    scan, model = scratch / "scan", scratch / "model"
    shutil.rmtree(scan, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", scan, *SCAN, *options], 600, check=True)
    report, failure = real_rig_scans.reconstruct(bench, scan, model, "--voxel-mm", 0.4)
    if report is None:
        return None, failure
    scores = real_rig_scans.evaluate(bench, scan, model)
    aligned = scores["aligned"]
    return (1000 * aligned["median_mm"], 1000 * aligned["p95_mm"], 100 * scores["covered_0.15_mm"]), ""


def told(values):
    return "{:.1f} / {:.1f} um, {:.2f} %".format(*values)


def measure(bench, scratch):
    whole, failure = figures(bench, scratch, real_rig_scans.WORKSHOP)
    if whole is None:
        bench.line("workshop, half size, 8 views", "a model", failure, False)
        return
    bench.line("workshop, half size, 8 views: median / p95, truth within 0.15 mm", "reported", told(whole), True)
    ideal, failure = figures(bench, scratch, [])
    bench.line("laboratory, the same", "reported", told(ideal) if ideal else failure, ideal is not None)
    for name in bench.in_time((*FAMILIES, *EFFECTS)):
        without, failure = figures(bench, scratch, [*real_rig_scans.WORKSHOP, "--without", name])
        if without is None:
            bench.line(f"without {name}", "a model", failure, False)
            continue
        cost = whole[0] - without[0], whole[1] - without[1], without[2] - whole[2]
        bench.line(f"without {name}", "reported", f"{told(without)}; it costs {cost[0]:+.1f} / {cost[1]:+.1f} um, {cost[2]:+.2f} points",
                   True)
