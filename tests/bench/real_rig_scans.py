"""Scans of the simulated workshop, with a calibration that the project's own solver made from the workshop's boards."""
import json
import math
import shutil

import mesh_shapes
from calibration_watch import times

WORKSHOP = ["--profile", "workshop"]
RIM_DOTS = "40x84.5x2.4"


def own_calibration(bench):
    """calibration.json of the workshop. Made once in a run, then kept: boards and solver are the same for all parts."""
    boards = bench.out / "workshop-boards"
    file = boards / "calibration.json"
    if file.is_file() and boards in bench.made:
        return file
    shutil.rmtree(boards, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot-board", *WORKSHOP, "--out", boards], 1200, check=True)
    done = bench.run([bench.bin / "scanrig", "calibrate", boards, "--json", "--out", file, "--rim-dots", RIM_DOTS], 600)
    if done.returncode != 0:
        raise RuntimeError(f"the workshop cannot be calibrated: {done.stderr.strip()[-300:]}")
    (boards / "judgement.json").write_text(done.stdout)
    bench.made.add(boards)
    return file


def mesh_of(bench, name, folder):
    """Options that choose an object; None where its file is not here."""
    if name == "figurine":
        return []
    if name in ("knot", "pawn"):
        return ["--object", getattr(mesh_shapes, name)(folder / f"{name}.ply")]
    files = {"spot": "spot/spot_triangulated.obj", "igea": "igea_tri.ply",
             "banana": "ycb_banana/textured_simple_reoriented.obj"}
    return ["--object", bench.data / "meshes" / files[name]] if bench.data else None


def shoot(bench, scan, options):
    """One scan of the workshop that knows its own calibration."""
    shutil.rmtree(scan, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot", *WORKSHOP, "--out", scan, "--calibration", own_calibration(bench), *options],
              1200, check=True)
    return scan


def reconstruct(bench, scan, model, *options):
    """The report, or the sentence of the failure."""
    shutil.rmtree(model, ignore_errors=True)
    done = bench.run([bench.bin / "scanrig", "reconstruct", scan, "--out", model, "--no-texture", *options], 1200)
    if done.returncode != 0:
        return None, done.stderr.strip()[-300:]
    return json.loads((model / "report.json").read_text()), ""


def evaluate(bench, scan, model):
    done = bench.run([bench.bin / "scanrig", "evaluate", scan, "--model", model, "--json"], 600, check=True)
    return json.loads(done.stdout)


def in_truth_frame(transform, mm):
    """pose1_from_pose2 of a frame that lies `mm` higher than the truth's, in that of the truth."""
    up = [0.0, mm, 0.0]
    shifted = [t + a - b for t, a, b in zip(transform["translation"], up, times(transform["rotation"], up))]
    return transform["rotation"], shifted


def pose2_error(scan, report):
    """Degrees, and mm at the model's centre, that pose1_from_pose2 is off. A calibration's frame begins at the rim dots, on
    the top; the truth's begins where boards lie, which sink into it."""
    higher = json.loads((scan / "rig_truth.json").read_text())["effects"]["top_height_mm"]
    true = json.loads((scan / "truth.json").read_text())["pose1_from_pose2"]
    rotation, translation = in_truth_frame(report["pose1_from_pose2"], higher)
    turn = [times(true["rotation"], row) for row in rotation]  # found times the transpose of the true rotation
    centre = report["mesh"]["centre_of_mass"]
    moved = times(turn, [c - t for c, t in zip(centre, true["translation"])])
    off = [m + t - c for m, t, c in zip(moved, translation, centre)]
    # Of small angles the trace's arc cosine keeps too few digits.
    axis = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]]
    return math.degrees(math.asin(min(1.0, math.hypot(*axis) / 2))), math.hypot(*off)
