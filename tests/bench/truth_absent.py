"""The model depends neither on the truth's presence nor on the number of threads; the report has the required keys."""
import hashlib
import pathlib
import shutil
import subprocess

from slowness import SLOWNESS

LIMIT_S = 900 * SLOWNESS
FILES = ("model.glb", "model.ply", "model.obj", "model.stl")

# What the group end-to-end requires of every report, as paths of keys; `[]` stands for every element of a list.
REPORT = (
    "software.name", "software.version", "options.voxel_mm", "options.fusion", "options.rests", "calibration_sha256",
    "profile_sha256", "stages[].stage", "stages[].seconds", "stages[].process_peak_memory_mib", "poses[].views[]",
    "pose_estimate.tangent_planes[].tangent_planes", "pose_estimate.tangent_planes[].after_base_plane",
    "pose_estimate.tangent_planes[].after_stability", "pose_estimate.tangent_planes[].after_height",
    "pose_estimate.chosen", "pose_estimate.alternatives", "pose_estimate.condition", "integration.conflicts",
    "integration.class_pairs", "mesh.components", "mesh.genus", "mesh.watertight", "mesh.faces", "mesh.measured_share",
    "mesh.closed_share")


def lacks(value, path):
    if not path:
        return False
    key, _, rest = path.partition(".")
    name = key.removesuffix("[]")
    if not isinstance(value, dict) or name not in value:
        return True
    inner = value[name]
    if key.endswith("[]"):
        return not inner or any(lacks(element, rest) for element in inner)
    return lacks(inner, rest)


def report_gaps(report):
    return [path for path in REPORT if lacks(report, path)]


def model_hash(binaries, scan, out, threads):
    subprocess.run([str(binaries / "scanrig"), "reconstruct", str(scan), "--out", str(out), "--threads", str(threads),
                    "--voxel-mm", "0.5"], check=True, capture_output=True, timeout=LIMIT_S)
    whole = hashlib.sha256()
    for name in FILES:
        whole.update((out / name).read_bytes())
    return whole.hexdigest()


def cases(binaries, scratch):
    """Yields (name, ok, what was seen)."""
    home = pathlib.Path(scratch).resolve() / "truth_absent"
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    scan = home / "scan"
    subprocess.run([str(binaries / "scanrig-sim"), "shoot", "--out", str(scan), "--views", "6", "--scale", "0.5"],
                   check=True, capture_output=True, timeout=LIMIT_S)
    first = model_hash(binaries, scan, home / "with_truth", 2)
    one = model_hash(binaries, scan, home / "one_thread", 1)
    yield "one thread or two", one == first, f"{first[:12]} and {one[:12]}"
    for name in ("truth.json", "truth.ply"):
        (scan / name).unlink()
    without = model_hash(binaries, scan, home / "without_truth", 4)
    yield "truth files absent, four threads", without == first, f"{first[:12]} and {without[:12]}"
