"""Rendered scans and timed reconstructions of the group `fast`."""
import json
import os
import resource
import shutil
import statistics
import subprocess
import time


def shoot(bench, name, *options):
    """A rendered scan of the figurine in the laboratory, made once in a run."""
    folder = bench.out / name
    if folder not in bench.made:
        shutil.rmtree(folder, ignore_errors=True)
        bench.run([bench.bin / "scanrig-sim", "shoot", "--out", folder, *options], 1800, check=True)
        bench.made.add(folder)
    return folder


def thinned(scan, folder, views):
    """The same scan of one pose with `views` of its views, evenly spread and numbered anew; images are links to those of
    `scan`."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for path in scan.iterdir():
        if path.name not in ("scan.json", "model"):
            os.symlink(path, folder / path.name)
    manifest = json.loads((scan / "scan.json").read_text())
    (pose,) = manifest["poses"]
    if len(pose["views"]) % views:
        raise ValueError(f"{views} of {len(pose['views'])} views are not evenly spread")
    pose["views"] = [{**view, "index": i} for i, view in enumerate(pose["views"][::len(pose["views"]) // views])]
    (folder / "scan.json").write_text(json.dumps(manifest))
    return folder


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Timed:
    """One reconstruction: wall seconds, seconds of the processor, peak memory, seconds of its stages."""

    def __init__(self, bench, scan, model, *options):
        shutil.rmtree(model, ignore_errors=True)
        begun, used = time.monotonic(), children_seconds()
        process = subprocess.Popen([str(bench.bin / "scanrig"), "reconstruct", str(scan), "--out", str(model), *options],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        _, error = process.communicate(timeout=1200)
        self.seconds, self.processor_seconds = time.monotonic() - begun, children_seconds() - used
        if process.returncode != 0:
            raise RuntimeError(f"{scan.name}: {error.strip()[-300:]}")
        report = json.loads((model / "report.json").read_text())
        self.stages = {stage["stage"]: stage["seconds"] for stage in report["stages"]}
        self.peak_mib = max(stage["process_peak_memory_mib"] for stage in report["stages"])
        self.voxels = report["integration"]["active_voxels"]
        self.geometry = (model / "model.ply").read_bytes()


def median_of(runs, figure):
    return statistics.median(figure(run) for run in runs)
