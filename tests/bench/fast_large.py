"""Part `large` of the group `fast`: 12 MP x 64 views x 0.1 mm of an object of 200 mm within 8 and 4 GiB.

The views are made by intersecting rays (bench_large): rendering and matching 64 of 12 MP takes hours. What matching needs
is measured with two rendered ones. Texture has no part in it."""
import json
import os
import subprocess
import time

import fast_runs

WIDTH, VIEWS, VOXEL_MM = 4096, 64, 0.1
QUICK = (2048, 16, 0.25)
GIB = (8, 4)
MINUTES = 20
MATCHED_SCALE = "3.2"


def integrated(bench, width, views, voxel_mm, gib):
    done = bench.run([bench.bin / "bench_large", str(width), str(views), str(voxel_mm), str(gib)], 7200, check=True)
    return json.loads(done.stdout)


def matched(bench, scratch):
    """Two views at once, as with memory for both. They share too little to be registered: what is measured comes before."""
    scan = fast_runs.shoot(bench, "fast-large", "--poses", "1", "--views", "2", "--scale", MATCHED_SCALE, "--one-exposure")
    start = time.monotonic()
    process = subprocess.Popen([bench.bin / "scanrig", "reconstruct", scan, "--out", scratch / "model", "--no-texture"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, _, used = os.wait4(process.pid, 0)
    seconds = (time.monotonic() - start) / 2
    bench.line("a view of 12.6 MP matched", "reported", f"{seconds:.1f} s, {VIEWS} of them {VIEWS * seconds / 60:.1f} min", True)
    bench.at_most("two views of 12.6 MP, matched at once: peak memory", 3072, used.ru_maxrss / 1024, "MiB", digits=0)


def measure(bench, scratch):
    width, views, voxel_mm = bench.pick((WIDTH, VIEWS, VOXEL_MM), QUICK, QUICK)
    name = f"{views} views of {width * width * 3 / 4e6:.1f} MP, voxels of {voxel_mm} mm"
    runs = [integrated(bench, width, views, voxel_mm, gib) for gib in GIB]
    for gib, run in zip(GIB, runs):
        bench.at_most(f"{name}, within {gib} GiB: peak memory", 1024 * gib, run["peak_mib"], "MiB", digits=0)
        bench.line(f"{name}, within {gib} GiB: integration", "reported",
                   f"{run['seconds'] / 60:.1f} min in {run['places']} places, {run['vertices']} vertices", True)
    bench.line(f"{name}: handles of an object with one", "1", str(runs[0]["genus"]), runs[0]["genus"] == 1)
    bench.at_most(f"{name}, within {GIB[0]} GiB: minutes", MINUTES, runs[0]["seconds"] / 60, digits=1)
    bench.at_most("a compact view: bytes a measured pixel, masks included", 9.0, runs[0]["bytes_per_pixel"], digits=2)
    same = len({run["hash"] for run in runs}) == 1
    bench.line(f"bits within {GIB[0]} and {GIB[1]} GiB", "equal", "equal" if same else "differ", same)
    matched(bench, scratch)
