"""Calibration: drawn rigs from images alone, models by their own calibration, faults, the drift check."""
import json
import math
import shutil
import time

import calibration_debian13
import calibration_faults
import calibration_series
import calibration_watch

RIGS = 8
OBJECTS = {"figurine": None, "spot": "spot/spot_triangulated.obj", "igea": "igea_tri.ply"}  # of the data's meshes


def rigs(bench, scratch):
    """The whole flow: images of a rig that nothing is known of, and one command."""
    squares = predicted = good = graded = count = 0
    for seed in bench.in_time(range(1, 1 + bench.pick(full=RIGS, sampled=RIGS, quick=1))):
        folder = scratch / f"rig{seed}"
        calibration_series.shoot(bench, folder, seed, calibration_series.NOISE)
        done = calibration_series.calibrate(bench, folder, calibration_series.RIM_DOTS)
        count += 1
        if done.returncode != 0:
            bench.note(f"rig {seed}: {done.stderr.strip()[-300:]}")
            continue
        grade = json.loads(done.stdout)["grade"]
        error = calibration_series.error_of(bench, folder, seed, "noise=1")
        deserved = "A" if error["rms_um"] <= 5 else "B"
        bench.note(f"rig {seed}: {error['rms_um']:.2f} um rms, {error['max_um']:.1f} at most, predicted "
                   f"{error['predicted_um']:.2f}, scale {error['scale_ppm']:.0f} ppm, grade {grade}")
        squares += error["rms_um"] ** 2
        predicted += error["predicted_um"] ** 2
        good += error["rms_um"] <= 6
        graded += grade == deserved
        calibration_series.remove(folder)
    bench.line("drawn rigs, from images: volume error", f"<= 6 um rms in {count} of {count}", f"{good} of {count}",
               good == count)
    ratio = math.sqrt(squares / predicted) if predicted else 0.0
    bench.line("the same: actual over predicted, rms", "0.8 to 1.3", f"{ratio:.2f}", 0.8 <= ratio <= 1.3)
    bench.line("the same: grade", f"right in {count}", f"{graded} of {count}", graded == count)


def scores(bench, scan, model):
    shutil.rmtree(model, ignore_errors=True)
    bench.run([bench.bin / "scanrig", "reconstruct", scan, "--out", model, "--no-texture"], 1200, check=True)
    done = bench.run([bench.bin / "scanrig", "evaluate", scan, "--model", model, "--json"], 600)
    return json.loads(done.stdout)["measured"]  # whatever the gates say: there is no texture


def compare_model(bench, scratch, name, seed, calibration):
    """A scan of a drawn rig, with the true calibration and with its own."""
    if OBJECTS[name] and not bench.data:
        bench.line(f"{name} seed {seed}, own over true calibration", "<= 1.05", "not measured: no data", None)
        return
    options = ["--object", bench.data / "meshes" / OBJECTS[name]] if OBJECTS[name] else []
    scan, own = scratch / "scan", scratch / "own"
    for folder in (scan, own):
        shutil.rmtree(folder, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", scan, "--rig-seed", seed, "--seed", seed, *calibration_series.NOISE, *options],
              1200, check=True)
    shutil.copytree(scan, own)
    calibration_series.replace_calibration(own, calibration)
    true_scores, own_scores = scores(bench, scan, scratch / "m1"), scores(bench, own, scratch / "m2")
    for figure in ("median_mm", "p95_mm"):
        ratio = own_scores[figure] / true_scores[figure]
        bench.line(f"{name} seed {seed}, own over true calibration: {figure}", "<= 1.05",
                   f"{ratio:.3f} ({own_scores[figure]:.4f} mm)", ratio <= 1.05)


def models(bench, scratch):
    boards = scratch / "boards"
    for seed in range(1, 1 + bench.pick(full=2, sampled=1, quick=1)):
        calibration_series.shoot(bench, boards, seed, calibration_series.NOISE)
        calibration_series.calibrate(bench, boards, calibration_series.RIM_DOTS).check_returncode()
        for name in list(OBJECTS)[:bench.pick(full=3, sampled=2, quick=1)]:
            compare_model(bench, scratch, name, seed, boards / "calibration.json")


def drift(bench, scratch):
    """The station's check on a running rig, by the real clock."""
    socket, jobs = scratch / "api.sock", scratch / "jobs"
    daemon = calibration_series.start_rig(bench, scratch, socket, jobs)
    try:
        client = [bench.bin / "scanrig", "calibrate", "--socket", socket]
        bench.run([*client, "--rig"], 1200, check=True)
        bench.run([*client, "--accept"], 60, check=True)
        begun = time.monotonic()
        done = bench.run([*client, "--check"], 300)
        seconds = time.monotonic() - begun
    finally:
        daemon.terminate()
        daemon.wait()
    bench.line("drift check of an untouched rig", "holds", done.stdout.strip().splitlines()[-2].strip()
               if done.returncode == 0 else done.stderr.strip(), "holds" in done.stdout)
    bench.at_most("drift check, on the real clock", 70, seconds, "s", digits=0)


PARTS = {"rigs": rigs,
         "faults": calibration_faults.measure,
         "models": models,
         "watch": calibration_watch.measure,
         "drift": drift,
         "debian13": calibration_debian13.measure}
