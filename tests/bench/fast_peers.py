"""Part `peers` of the group `fast`: this project's integration and pose search beside Open3D's, on the same range
images in the same run. No texture is compared: Debian has no program that makes an atlas of calibrated photographs."""
import json
import os
import pathlib
import statistics

import fast_runs

VOXEL_MM = "0.25"
SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's, to which its Open3D belongs
FASTER = 3
NAMES = {"own": "this project", "scalable": "Open3D ScalableTSDFVolume", "blocks": "Open3D VoxelBlockGrid"}
# Threads that wait must not spin: beside other programs they would hold the core that the last one needs.
QUIET_WAITING = {"OMP_WAIT_POLICY": "passive"}


def has_open3d(bench):
    return pathlib.Path(SYSTEM_PYTHON).exists() and bench.run([SYSTEM_PYTHON, "-c", "import open3d"], 60).returncode == 0


def run(bench, *command, **options):
    done = bench.run(command, 600, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{pathlib.Path(command[0]).name}: {done.stderr.strip()[-200:]}")
    return done.stdout


def median_of(pairs):
    """Of wall seconds, and of seconds of the processor."""
    return [statistics.median(values) for values in zip(*pairs)]


def words_of(seconds):
    return f"{seconds[0]:.2f} s ({seconds[1]:.2f} of the processor)"


def fused(bench, own, peers, surfaces):
    seconds = {"own": median_of(own["integration_seconds"]), **peers["fusion_seconds"]}
    for name, words in NAMES.items():
        surface = surfaces[name]
        bench.line(f"16 range images, voxels of {VOXEL_MM} mm, by {words}: seconds; median, p95 error; > 0.25 mm; truth "
                   "within 0.1 mm", "reported",
                   f"{words_of(seconds[name])}; {surface['median_mm']:.4f}, {surface['p95_mm']:.4f} mm; "
                   f"{100 * surface['beyond']:.3f} %; {100 * surface['covered']:.1f} %", True)
    bench.line("the same by this project, handles and crossing faces not mended", "reported",
               words_of(median_of(own["bare_seconds"])), True)
    others = [name for name in NAMES if name != "own"]
    faster = min(others, key=seconds.get)
    bench.note(f"the faster one is {NAMES[faster]}")
    bench.at_least("integration: times as fast as the faster of Open3D's two", FASTER,
                   seconds[faster][0] / seconds["own"][0], digits=2)
    bench.line("the same by seconds of the processor", "reported", f"{seconds[faster][1] / seconds['own'][1]:.2f}", True)
    for figure in ("median_mm", "p95_mm"):
        best = min(surfaces[name][figure] for name in others)
        bench.at_most(f"the same: error over that of the better one, {figure}", 1.0, surfaces["own"][figure] / best,
                      digits=2)


def motions(bench, own, peers):
    found = peers["motions"]
    partial = [sum(values) for values in zip(*own["partial_seconds"])]
    bench.line("pose 2 in pose 1 by this project: seconds; error", "reported",
               f"{words_of(median_of(own['pose_seconds']))}, {words_of(partial)} for its two partial models; "
               f"{found['own']['deg']:.4f} deg, {found['own']['mm']:.4f} mm", True)
    bench.line("the same by Open3D's FGR and ICP: seconds; error", "reported",
               f"{words_of(peers['features_seconds'])}; {found['features']['deg']:.4f} deg, "
               f"{found['features']['mm']:.4f} mm", True)


def measure(bench, scratch):
    if not has_open3d(bench):
        bench.line("16 range images by this project and Open3D", "-", "not measured: python3-open3d is not here", None)
        return
    scan, folder = fast_runs.shoot(bench, "fast-scan"), scratch / "fusion"
    rounds = str(bench.pick(5, 5, 1))
    run(bench, bench.bin / "bench_fusion", scan, folder, VOXEL_MM, rounds)
    own = json.loads((folder / "views.json").read_text())
    program = pathlib.Path(__file__).resolve().parent / "fusion_peers.py"
    peers = json.loads(run(bench, SYSTEM_PYTHON, program, folder, VOXEL_MM, rounds, env={**os.environ, **QUIET_WAITING}))
    files = [folder / f"{name}.ply" for name in NAMES]
    surfaces = json.loads(run(bench, bench.bin / "bench_surfaces", scan / "truth.ply", *files))
    bench.note(f"Open3D {peers['version']}; load of the machine {os.getloadavg()[0]:.1f} on {bench.cores} cores")
    fused(bench, own, peers, dict(zip(NAMES, surfaces)))
    motions(bench, own, peers)
