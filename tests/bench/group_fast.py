"""How long a model takes: one view, its stages, a whole scan offline, and a job from its last image to its model.

Seconds were asked for on one kind of machine, ratios elsewhere: OpenCV's 3WAY on the same pair, in the same run, says how
much slower this machine is, and limits grow by that.
"""
import json
import os
import pathlib
import shutil
import time

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


def live(bench, _scratch):
    """From the last image on disk to the model on disk, of a job of two poses; to the partial model of the first. The rig
    on the wire renders its views before the job: as a real one, it needs the processor for sending them alone."""
    folder = bench.out / "fast-demo"
    shutil.rmtree(folder, ignore_errors=True)
    demo = pathlib.Path(__file__).resolve().parent.parent.parent / "sim" / "apps" / "demo.py"
    done = bench.run(["python3", demo, "--bin", bench.bin, "--out", folder, "--calibration", "true", "--profile",
                      "laboratory", "--wire"], 1800)
    reports = list(folder.rglob("model/report.json"))
    if not reports:
        bench.line("last image to model on disk", "<= 3.0 s", f"no model: {done.stderr.strip()[-200:]}", False)
        return
    images = [file for file in reports[0].parent.parent.rglob("*.png") if "pose2" in str(file)]
    written = max(file.stat().st_mtime for file in reports[0].parent.iterdir())
    seconds_at_most(bench, "last image to model on disk, job of two poses", 3.0,
                    written - max(file.stat().st_mtime for file in images))


def idle(bench, scratch):
    """The daemon beside a rig on the wire that does nothing."""
    with motion_rig.Rig(bench.bin, scratch / "idle") as rig:
        rig.start_daemon()
        rig.get_ready()
        time.sleep(5)
        tasks = f"/proc/{rig.daemon.pid}/task"

        def used():
            ticks = switches = 0
            for task in os.listdir(tasks):
                fields = open(f"{tasks}/{task}/stat").read().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
                for line in open(f"{tasks}/{task}/status"):
                    if line.startswith("voluntary_ctxt"):
                        switches += int(line.split()[1])
            return ticks / os.sysconf("SC_CLK_TCK"), switches

        before = used()
        time.sleep(IDLE_S)
        after = used()
    bench.at_most("idle daemon: share of a core", 0.3, 100 * (after[0] - before[0]) / IDLE_S, "%", digits=2)
    bench.at_most("idle daemon: wake-ups a second", 30, (after[1] - before[1]) / IDLE_S, digits=0)


PARTS = {"view": view, "scan": scan, "peers": fast_peers.measure, "scaling": fast_scaling.measure, "live": live,
         "idle": idle, "slurm": fast_slurm.measure}
