"""The API under load during scans and reconstructions: delay and age of the status, and the cost for the scan.

The shipped daemon and two simulated GigE cameras with images rendered beforehand: a renderer that uses every core
would be slowed by other programs. This file runs again in a network of its own.
"""
import json
import pathlib
import socket
import statistics
import subprocess
import sys
import time

import motion_rig

HERE = pathlib.Path(__file__).resolve().parent
OPTIONS = ("--cameras", "gige", "--poses", "1", "--speed-deg-s", "90", "--acceleration-deg-s2", "400")
FULL = {"jobs": 5, "views": "8", "scale": 0.5, "voxel": "0.5"}
SAMPLED = dict(FULL, jobs=3)
QUICK = {"jobs": 1, "views": "4", "scale": 0.25, "voxel": "1"}
JOB_LIMIT_S = 300
LIMIT_S = 2400
LOOK_S = 0.005  # a higher rate would exceed the API's limit
P99_LIMIT_MS, AGE_LIMIT_MS, SLOWER_LIMIT_PERCENT = 20, 200, 2


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def open_api(rig):
    """Adds TCP to the rig's configuration; the port and a viewer's token."""
    port, tokens = free_port(), rig.folder / "tokens.json"
    made = subprocess.run([rig.bin / "scanrig", "token", "add", "bench", "--role", "viewer", "--file", tokens],
                          capture_output=True, text=True, timeout=10)
    rig.edit_config("[api]\n", f'[api]\nhttp_port = {port}\ntokens = "tokens.json"\n')
    return port, made.stdout.strip()


class Load:
    """http_load.py beside the daemon, for as long as the block lasts."""

    def __init__(self, rig, port, token):
        self.command = [sys.executable, HERE / "http_load.py", "--socket", rig.api, "--port", port, "--token", token]
        self.seen = {}

    def __enter__(self):
        self.process = subprocess.Popen([str(word) for word in self.command], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        return self

    def __exit__(self, *_):
        out, _ = self.process.communicate(timeout=60)
        self.seen = json.loads(out)


def age_ms(rig):
    """Time from an edge at the panel until the API shows it."""
    pressed = not rig.ask("io")["inputs"]["part_present"]
    at_ns = rig.press("part") if pressed else rig.release("part")
    end = time.monotonic() + 5
    while time.monotonic() < end:
        if rig.ask("io")["inputs"]["part_present"] == pressed:
            return (time.monotonic_ns() - at_ns) / 1e6
        time.sleep(LOOK_S)
    return 5000.0


def one_job(rig, ages):
    """Seconds of acquisition of one job, watched to its end; notes the age of snapshots meanwhile."""
    before = {job["id"] for job in rig.ask("jobs")["jobs"]}
    rig.tap("start")
    rig.wait(lambda: rig.status()["activity"] == "scanning", 30)
    begun, taken = time.monotonic(), None
    while time.monotonic() < begun + JOB_LIMIT_S:
        if taken is None and rig.status()["machine"] == "Operational.Ready":
            taken = time.monotonic() - begun
        jobs = [job for job in rig.ask("jobs")["jobs"] if job["id"] not in before]
        if taken is not None and jobs and jobs[0]["state"] in ("done", "failed", "interrupted", "cancelled"):
            return taken if jobs[0]["state"] == "done" else None
        if ages is not None:
            ages.append(age_ms(rig))
        time.sleep(0.05)
    return None


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else None


def seconds(values):
    return ", ".join(f"{value:.2f}" for value in values)


def inside(binaries, scratch, size):
    """Results of the load, age of snapshots, and the seconds of each acquisition without load and with it."""
    ages, quiet, loaded = [], [], []
    with motion_rig.Rig(binaries, scratch / "load", *OPTIONS, "--scale", size["scale"], "--views", size["views"],
                        "--voxel-mm", size["voxel"]) as rig:
        port, token = open_api(rig)
        rig.start_shipped_daemon()
        rig.get_ready()
        for _ in range(2):  # the table stops at slightly different angles in every other turn: both are rendered now
            one_job(rig, None)
        for _ in range(size["jobs"]):
            quiet.append(one_job(rig, []))  # watched in the same way: only the load differs
        with Load(rig, port, token) as load:
            for _ in range(size["jobs"]):
                loaded.append(one_job(rig, ages))
    print(json.dumps([load.seen, ages, quiet, loaded]))


def measure(bench, scratch):
    size = bench.pick(full=FULL, sampled=SAMPLED, quick=QUICK)
    done = bench.run([bench.bin / "scanrig-sim", "own-network", "--", sys.executable, __file__, bench.bin, scratch,
                      json.dumps(size)], LIMIT_S)
    if done.returncode != 0:
        bench.note(done.stderr.strip()[-500:])
        bench.line("the API under load", "measured", "not measured", False)
        return
    seen, ages, quiet, loaded = json.loads(done.stdout.splitlines()[-1])
    what = "50 event streams, 200 requests/s, 20 slow clients, during scan and reconstruction"
    jobs = f"{sum(t is not None for t in loaded)} of {size['jobs']} jobs done"
    bench.line(f"{what}: jobs", "all done", jobs, None not in loaded)
    bench.note(f"{len(seen['status_ms'])} status, {len(seen['others_ms'])} other requests, {seen['events']} events, "
               f"{seen['loris_cut']} slow clients cut off")
    bench.at_most(f"{what}: status, p99", P99_LIMIT_MS, percentile(seen["status_ms"], 0.99), "ms", 1)
    bench.at_most(f"{what}: other requests, p99", 5 * P99_LIMIT_MS, percentile(seen["others_ms"], 0.99), "ms", 1)
    bench.at_most(f"{what}: edge at the panel to the API, worst", AGE_LIMIT_MS, max(ages, default=None), "ms", 0)
    bench.line(f"{what}: refused or failed", "0", ", ".join(sorted(set(seen["failed"]))[:3]) or "0", not seen["failed"])
    bench.line(f"{what}: streams lost", "0", seen["streams_lost"], seen["streams_lost"] == 0)
    if None in quiet + loaded:
        bench.at_most(f"{what}: acquisition slower by", SLOWER_LIMIT_PERCENT, None, "%")
    else:
        bench.note(f"acquisition, s: quiet {seconds(quiet)}; under load {seconds(loaded)}")
        slower = 100 * (statistics.median(loaded) / statistics.median(quiet) - 1)
        bench.at_most(f"{what}: acquisition slower by", SLOWER_LIMIT_PERCENT, slower, "%", 1)


if __name__ == "__main__":
    inside(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), json.loads(sys.argv[3]))
