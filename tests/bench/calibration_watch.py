"""The watch on every scan: rigs that moved after their calibration are named, rigs that did not are left alone."""
import copy
import json
import math
import shutil

import calibration_series

SMALL = ["--scale", "0.5"]  # of the scans that show nothing but that nothing moved
SCANS_PER_RIG = 10


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def times(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def rotation(axis, angle):
    """About x (0), y (1) or z (2)."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned = [[float(row == column) for column in range(3)] for row in range(3)]
    turned[i][i] = turned[j][j] = c
    turned[i][j], turned[j][i] = -s, s
    return turned


def turn_right_camera(axis, px):
    def change(calibration):
        camera = calibration["right"]
        pose, turn = camera["camera_from_turntable"], rotation(axis, px / camera["fx"])
        pose["rotation"], pose["translation"] = product(turn, pose["rotation"]), times(turn, pose["translation"])
    return change


def move_axis(mm, deg):
    """To the side and about the line of sight."""
    def change(calibration):
        turn, shift = rotation(2, math.radians(deg)), [mm, 0.0, 0.0]
        for side in ("left", "right"):
            pose = calibration[side]["camera_from_turntable"]
            moved = times(pose["rotation"], shift)
            pose["translation"] = [a + b for a, b in zip(pose["translation"], moved)]
            pose["rotation"] = product(pose["rotation"], turn)
    return change


# What has moved since, a word of the sentence that names it, and how far from the untouched rig's a refined model may be:
# what refining with dots and rows leaves in simulation, um. Rows off by 0.1 px cost 1 um and refining them 9.
CHANGES = {"0.1 px along rows": (turn_right_camera(1, 0.1), "amera", 8),
           "0.1 px across rows": (turn_right_camera(0, 0.1), "amera", 9),
           "axis 0.05 mm and 0.02 deg": (move_axis(0.05, 0.02), "Table axis moved", 9)}


def reconstruct(bench, scan, model, mode):
    """Sentences of the watch, and the model's median; no median without a model."""
    shutil.rmtree(model, ignore_errors=True)
    done = bench.run([bench.bin / "scanrig", "reconstruct", scan, "--out", model, "--no-texture", "--watch", mode], 1200)
    if done.returncode != 0:
        return [done.stderr.strip()], None
    poses = json.loads((model / "report.json").read_text())["poses"]
    sentences = [sentence for pose in poses for sentence in (pose["watch"] or {"sentences": []})["sentences"]]
    scored = bench.run([bench.bin / "scanrig", "evaluate", scan, "--model", model, "--json"], 600)
    return sentences, json.loads(scored.stdout)["measured"]["median_mm"]


def shoot_and_calibrate(bench, scratch, seed, scale):
    boards = scratch / "boards"
    calibration_series.shoot(bench, boards, seed, [*calibration_series.NOISE, *scale])
    calibration_series.calibrate(bench, boards, calibration_series.RIM_DOTS).check_returncode()
    return boards / "calibration.json"


def scan_with(bench, scratch, seed, object_seed, calibration, options):
    scan = scratch / "scan"
    shutil.rmtree(scan, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", scan, "--rig-seed", seed, "--seed", object_seed, *calibration_series.NOISE,
               *options], 1200, check=True)
    calibration_series.replace_calibration(scan, calibration)
    return scan


def moved_rigs(bench, scratch):
    calibration = shoot_and_calibrate(bench, scratch, 1, [])
    scan = scan_with(bench, scratch, 1, 1, calibration, [])
    known = json.loads(calibration.read_text())
    sentences, untouched = reconstruct(bench, scan, scratch / "model", "refine")
    bench.line("watch, scan of an untouched rig", "nothing said", " ".join(sentences) or "nothing", not sentences)
    for name in list(CHANGES)[:bench.pick(full=3, sampled=3, quick=1)]:
        change, word, left_um = CHANGES[name]
        other = copy.deepcopy(known)
        change(other)
        file = scratch / "moved.json"
        file.write_text(json.dumps(other))
        calibration_series.replace_calibration(scan, file)
        _, before = reconstruct(bench, scan, scratch / "model", "report")
        sentences, after = reconstruct(bench, scan, scratch / "model", "refine")
        bench.line(f"watch, {name}", "named", " ".join(dict.fromkeys(sentences)),
                   any(word in sentence for sentence in sentences))
        bench.line(f"watch, {name}, median of the model: not refined, refined; untouched {untouched:.4f} mm",
                   f"refined within {left_um} um of the untouched, and nearer than not refined where that is farther off",
                   f"{before:.4f}, {after:.4f} mm" if after else "refused", after is not None and
                   abs(after - untouched) <= left_um / 1000 and
                   (abs(before - untouched) <= left_um / 1000 or abs(after - untouched) < abs(before - untouched)))


def untouched_rigs(bench, scratch):
    wrong = count = 0
    for seed in bench.in_time(range(1, 1 + bench.pick(full=4, sampled=1, quick=1))):
        calibration = shoot_and_calibrate(bench, scratch, seed, SMALL)
        for number in bench.in_time(range(1, 1 + bench.pick(full=SCANS_PER_RIG, sampled=4, quick=1))):
            scan = scan_with(bench, scratch, seed, number, calibration, [*SMALL, "--views", "6"])
            sentences, _ = reconstruct(bench, scan, scratch / "model", "report")
            count += 1
            wrong += bool(sentences)
            if sentences:
                bench.note(f"rig {seed}, scan {number}: {' '.join(dict.fromkeys(sentences))}")
    bench.line(f"watch, scans of untouched rigs: {count}", "0 false warnings", f"{wrong}", wrong == 0)


def measure(bench, scratch):
    moved_rigs(bench, scratch)
    untouched_rigs(bench, scratch)
