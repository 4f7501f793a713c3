"""Cameras of other resolutions on the same rig: errors go with the size of a pixel on the object."""
import shutil

import real_rig_scans

# Share of 1280x960, the simulated rig's largest.
SCALES = {"0.3 MP": 0.5, "1.2 MP": 1.0}
NEAR = 0.25
ONE_POSE = ["--poses", 1, "--views", 8]


def calibration_of(bench, folder, scale):
    """Of the workshop's boards as cameras of this resolution see them."""
    boards = folder / "boards"
    bench.run([bench.bin / "scanrig-sim", "shoot-board", *real_rig_scans.WORKSHOP, "--scale", scale, "--out", boards], 1800,
              check=True)
    file = boards / "calibration.json"
    done = bench.run([bench.bin / "scanrig", "calibrate", boards, "--json", "--out", file, "--rim-dots",
                      real_rig_scans.RIM_DOTS], 900)
    return (file, "") if done.returncode == 0 else (None, " ".join(done.stderr.split())[-200:])


def errors(bench, folder, scale):
    """Median and p95, um; or None and why there is no model."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    calibration, failure = calibration_of(bench, folder, scale)
    if calibration is None:
        return None, failure
    scan = folder / "scan"
    bench.run([bench.bin / "scanrig-sim", "shoot", *real_rig_scans.WORKSHOP, "--scale", scale, "--calibration", calibration,
               *ONE_POSE, "--out", scan], 1800, check=True)
    report, failure = real_rig_scans.reconstruct(bench, scan, folder / "model")
    if report is None:
        return None, failure
    aligned = real_rig_scans.evaluate(bench, scan, folder / "model")["aligned"]
    return (1000 * aligned["median_mm"], 1000 * aligned["p95_mm"]), ""


def measure(bench, scratch):
    found = {}
    for name, scale in SCALES.items():
        found[name], failure = errors(bench, scratch / f"cameras-{scale}", scale)
        if found[name] is None:
            bench.line(f"cameras of {name}", "a model", failure, False)
    base = found.get("1.2 MP")
    for name, scale in SCALES.items():
        if base is None or found[name] is None:
            continue
        # Of a pixel: 1 where the error is that of the middle cameras, in their pixels.
        relative = [own / of_base * scale for own, of_base in zip(found[name], base)]
        bench.line(f"cameras of {name}: median, p95; in pixels, beside those of 1.2 MP", f"within {100 * NEAR:.0f} %",
                   "{:.1f}, {:.1f} um; {:.2f}, {:.2f}".format(*found[name], *relative),
                   all(abs(value - 1.0) <= NEAR for value in relative))
