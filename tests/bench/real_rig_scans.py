"""Scans of the simulated workshop, with a calibration that the project's own solver made from the workshop's boards."""
import json
import shutil

import mesh_shapes

WORKSHOP = ["--profile", "workshop"]
RIM_DOTS = "40x84.5x2.4"
BELOW_LIMITS = 8  # exit code of `scanrig evaluate` for a model that misses one of its own limits


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
    """Scores against the truth, whether or not the model reaches the limits of `scanrig evaluate`."""
    done = bench.run([bench.bin / "scanrig", "evaluate", scan, "--model", model, "--json"], 600)
    if done.returncode not in (0, BELOW_LIMITS):
        raise RuntimeError(f"{scan.name} cannot be evaluated: {done.stderr.strip()[-300:]}")
    return json.loads(done.stdout)
