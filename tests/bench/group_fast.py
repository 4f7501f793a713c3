"""How long a model takes: one view, its stages, a whole scan offline, and a job from its last image to its model.

Seconds were asked for on one kind of machine, ratios elsewhere: OpenCV's 3WAY on the same pair, in the same run, says how
much slower this machine is, and limits grow by that.
"""
import contextlib
import json
import os
import pathlib
import shutil
import threading
import time

import fast_acquisition
import fast_large
import fast_peers
import fast_scaling
import fast_slurm
import motion_rig
from fast_runs import Timed, median_of, shoot

ROUNDS = 3
REFERENCE_3WAY_S = 0.20  # OpenCV's 3WAY on the machine on which the times were asked for
IDLE_S = 20


def peers_of(bench):
    """The first view by this project and by OpenCV, once in a run."""
    scan = shoot(bench, "fast-scan")
    if "peers" not in bench.measured:
        bench.measured["peers"] = json.loads(bench.run([bench.bin / "bench_range", "peers", scan], 600, check=True).stdout)
    return bench.measured["peers"]


def slower(bench):
    """How many times longer this machine takes than the one on which the times were asked for; not below 1."""
    return max(1.0, peers_of(bench)["sgbm_3way"]["seconds"] / REFERENCE_3WAY_S)


def seconds_at_most(bench, what, limit, value, digits=1):
    here = limit * slower(bench)
    bench.line(what, f"<= {limit:g} s x {slower(bench):.2f} = {here:.{digits}f} s", f"{value:.{digits}f} s", value <= here)


def view(bench, _scratch):
    found = peers_of(bench)
    own, pixels = found["own"], found["object_px"]
    bench.line("OpenCV's 3WAY: this machine, slower than the limits' own", "reported",
               f"{found['sgbm_3way']['seconds']:.2f} s for {REFERENCE_3WAY_S:.2f} s: x {slower(bench):.2f}", True)
    seconds_at_most(bench, "a view, images to range image with sigma, median of 5", 0.30, own["seconds"], 2)
    rate = 570000 / slower(bench)
    bench.line("the same, object pixels a second", f">= 570000 / {slower(bench):.2f} = {rate:.0f}",
               f"{pixels / own['seconds']:.0f}", pixels / own["seconds"] >= rate)
    for name, words in (("own", "this project"), ("sgbm_3way", "OpenCV 3WAY"), ("sgbm_hh4", "OpenCV HH4")):
        inner = found[name]["inner"]
        bench.line(f"the same view by {words}: seconds; measured; median, p95 error", "reported",
                   f"{found[name]['seconds']:.2f} s; {100 * inner['coverage']:.1f} %; {inner['median_px']:.3f}, "
                   f"{inner['p95_px']:.3f} px", True)


def scan(bench, scratch):
    """16 views offline."""
    folder = shoot(bench, "fast-scan")
    runs = [Timed(bench, folder, scratch / "model") for _ in range(bench.pick(5, ROUNDS, 1))]
    seconds_at_most(bench, "16 views offline, whole", 10, median_of(runs, lambda run: run.seconds))
    bench.at_most("the same: peak memory", 700, median_of(runs, lambda run: run.peak_mib), "MB", digits=0)
    asked = {"integration": 1.2, "texture": 1.5, "pose": 0.7}
    for stage in runs[0].stages:
        seconds = median_of(runs, lambda run, stage=stage: run.stages[stage])
        if stage in asked:
            seconds_at_most(bench, f"the same: {stage}", asked[stage], seconds, 2)
        else:
            bench.line(f"the same: {stage}", "reported", f"{seconds:.2f} s", True)
    single = Timed(bench, folder, scratch / "model", "--threads", "1")
    bench.at_least("the same: 2 threads against 1", 1.85, single.seconds / median_of(runs, lambda run: run.seconds))
    bench.line("the same: bits with 1 and 2 threads", "equal", "equal" if single.geometry == runs[0].geometry else "differ",
               single.geometry == runs[0].geometry)


class WrittenAt(threading.Thread):
    """When the first file of this pattern was written: live meshes are removed with the end of their job."""

    def __init__(self, folder, pattern):
        super().__init__(daemon=True)
        self.folder, self.pattern, self.at, self.is_over = folder, pattern, None, threading.Event()

    def run(self):
        while self.at is None and not self.is_over.wait(0.1):
            with contextlib.suppress(FileNotFoundError):  # removed between the two calls
                self.at = next((file.stat().st_mtime for file in self.folder.glob(self.pattern)), None)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.is_over.set()
        self.join()


def last_image(job, pose):
    return max(file.stat().st_mtime for file in (job / pose).rglob("*.png"))


def last_read_out(job, placement):
    """Of the cameras, by the rig's stamps, as a time of files. The first view again, which ends a pose, is kept on disk
    only where something has moved."""
    exposures = json.loads((job / "stamps.json").read_text())["exposures"]
    return max(one["read_ns"] for one in exposures if one["placement"] == placement) / 1e9 + time.time() - time.monotonic()


def live(bench, _scratch):
    """From the last image on disk to the model on disk, of a job of two poses; to the partial model of the first. The rig
    on the wire renders its views before the job: as a real one, it needs the processor for sending them alone."""
    folder = bench.out / "fast-demo"
    shutil.rmtree(folder, ignore_errors=True)
    demo = pathlib.Path(__file__).resolve().parent.parent.parent / "sim" / "apps" / "demo.py"
    with WrittenAt(folder, "rig/jobs/*/live/pose1.glb") as partial:
        done = bench.run(["python3", demo, "--bin", bench.bin, "--out", folder, "--calibration", "true", "--profile",
                          "laboratory", "--wire"], 1800)
    reports = list(folder.rglob("model/report.json"))
    if not reports:
        bench.line("last image to model on disk", "<= 3.0 s", f"no model: {done.stderr.strip()[-200:]}", False)
        return
    job = reports[0].parent.parent
    written = max(file.stat().st_mtime for file in reports[0].parent.iterdir())
    seconds_at_most(bench, "last image to model on disk, job of two poses", 3.0,
                    written - last_image(job, "pose2"))
    what = "last image of pose 1 to its partial model, shown at the flip"
    if partial.at is None:
        bench.line(what, "<= 1.0 s", "no partial model", False)
    else:
        seconds_at_most(bench, what, 1.0, partial.at - last_read_out(job, 0))
        bench.note(f"since the last view on disk, before the movement check: {partial.at - last_image(job, 'pose1'):.1f} s")


def used_by(process):
    """Seconds of the processor and voluntary switches of all its threads so far."""
    tasks = f"/proc/{process}/task"
    ticks = switches = 0
    for task in os.listdir(tasks):
        fields = open(f"{tasks}/{task}/stat").read().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
        for line in open(f"{tasks}/{task}/status"):
            if line.startswith("voluntary_ctxt"):
                switches += int(line.split()[1])
    return ticks / os.sysconf("SC_CLK_TCK"), switches


def idle(bench, scratch):
    """The daemon beside a rig on the wire that does nothing."""
    with motion_rig.Rig(bench.bin, scratch / "idle") as rig:
        rig.start_daemon()
        rig.get_ready()
        time.sleep(5)
        before = [used_by(process.pid) for process in (rig.daemon, rig.process)]
        time.sleep(IDLE_S)
        after = [used_by(process.pid) for process in (rig.daemon, rig.process)]
    (share, wakes), (rig_share, rig_wakes) = [((b[0] - a[0]) / IDLE_S, (b[1] - a[1]) / IDLE_S)
                                              for a, b in zip(before, after)]
    bench.at_most("idle daemon: share of a core", 0.3, 100 * share, "%", digits=2)
    bench.at_most("idle daemon: wake-ups a second", 30, wakes, digits=0)
    bench.line("the simulated rig beside it: share of a core, wake-ups a second", "reported",
               f"{100 * rig_share:.2f} %, {rig_wakes:.0f}", True)


PARTS = {"view": view, "scan": scan, "peers": fast_peers.measure, "scaling": fast_scaling.measure, "live": live,
         "acquisition": fast_acquisition.measure, "idle": idle, "large": fast_large.measure, "slurm": fast_slurm.measure}
