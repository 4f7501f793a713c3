"""Kills a daemon before and after every call that changes its files, and cuts the power there; then restarts it.

The job is a two-pose job of three views over simulated devices (tests/bench/station/one_job.cpp): all of the
daemon's own file handling, in a fraction of a second. After each start every job found must come to its end, resumed
or ended, and every acknowledged view must exist and be whole.
"""
import errno
import os
import pathlib
import random
import shutil
import subprocess

import sample
import station_disk
from slowness import SLOWNESS

LIMIT_S = 60 * SLOWNESS
SIDES = ("before", "after")


class Rig:
    def __init__(self, binaries, scratch):
        self.program = pathlib.Path(binaries).resolve() / "station_one_job"
        self.watcher = pathlib.Path(binaries).resolve() / "disk_calls.so"
        self.home = station_disk.quick_folder(scratch).resolve() / "kill"

    def fresh(self, name):
        home = self.home / name
        shutil.rmtree(home, ignore_errors=True)
        (home / "jobs").mkdir(parents=True)
        return home

    def run(self, verb, home, crash=False, again=False, **watch):
        environment = dict(os.environ)
        if again:
            environment["ONE_JOB_AGAIN"] = "1"
        if crash:
            environment["ONE_JOB_CRASH"] = "1"
        if watch:
            environment["LD_PRELOAD"] = str(self.watcher)
            environment["DISK_CALLS_ROOT"] = str(home / "jobs")
            environment.update({f"DISK_CALLS_{key.upper()}": str(value) for key, value in watch.items()})
        try:
            return subprocess.run([self.program, verb, home], env=environment, capture_output=True, text=True,
                                  timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess([], 124, f"still running after {LIMIT_S} s", "")

    def recovers(self, home, again=False):
        """None, or the failure. `again`: a client requests the model of a failed job once more."""
        done = self.run("recover", home, again=again)
        return None if done.returncode == 0 else (done.stdout + done.stderr).strip().replace("\n", "; ")

    def record(self):
        """Log of one whole job."""
        home = self.fresh("record")
        log = self.home / "log"
        done = self.run("scan", home, log=log, acks=home / "acks")
        if done.returncode != 0:
            raise RuntimeError(f"the job cannot be done at all: {done.stdout}{done.stderr}")
        return home, list(station_disk.read_log(log))


def one_kill(rig, number, when):
    """SIGKILL before or after the `number`-th call. Returns the failure, or None; and whether the kill took place."""
    home = rig.fresh("killed")
    end = rig.run("scan", home, kill=number, when=when)
    if end.returncode not in (0, -9):
        return f"the daemon ended with {end.returncode}: {end.stdout}{end.stderr}", False
    return rig.recovers(home), end.returncode == -9


def calls_of(log):
    """The calls by which the recorded job changed its files, in order; call 1 is the first."""
    return [entry for entry in log if entry[0] != "ack"]


def call_numbers(calls, count=None, seed=1):
    """Numbers of calls: all of them, or `count` random ones with every kind of call among them, ascending."""
    return sorted(sample.choose(range(1, len(calls) + 1), count, lambda number: calls[number - 1][0], seed))


def kill_points(calls, count=None, seed=1):
    """(number, side) of calls: both sides of all, or `count` random ones with both sides of every kind among them."""
    return sample.choose([(number, side) for number in range(1, len(calls) + 1) for side in SIDES], count,
                         lambda point: (calls[point[0] - 1][0], point[1]), seed)


def kills(rig, points):
    """Yields (what, fault or None) for each (number, side) of `points`."""
    for number, when in points:
        fault, killed = one_kill(rig, number, when)
        if killed:
            yield f"killed {when} call {number}", fault


def random_kills(rig, count, seed=6):
    """SIGKILL at any time, also between two calls."""
    chance = random.Random(seed)
    for _ in range(count):
        home = rig.fresh("killed_at_random")
        after = chance.uniform(0.0, 0.5)
        daemon = subprocess.Popen([rig.program, "scan", home], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            daemon.wait(timeout=after)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()
        # Before the calibration exists there is no rig.
        if (home / "calibration.json").exists():
            yield f"killed after {1000 * after:.0f} ms", rig.recovers(home)


def second_kills(rig, calls, count, seed=2):
    """A second kill during the recovery from a first one: both may have come during reconstruction."""
    chance = random.Random(seed)
    for _ in range(count):
        first, second = chance.randint(1, calls), chance.randint(1, calls)
        home = rig.fresh("killed_twice")
        rig.run("scan", home, kill=first, when="after")
        rig.run("recover", home, kill=second, when="after")
        yield f"killed after call {first} and after call {second} of the recovery", rig.recovers(home, again=True)


def power_cuts(rig, home, log, numbers):
    """Yields (what, fault or None) for a power cut after each of the logged calls with these numbers."""
    disk, acks, calls = station_disk.Disk(str(home / "jobs")), b"", 0
    chosen = set(numbers)
    for kind, path, other, data in log:
        if kind == "ack":
            acks += data
            continue
        disk.apply(kind, path, other, data)
        calls += 1
        if calls not in chosen:
            continue
        cut = rig.fresh("cut")
        shutil.rmtree(cut / "jobs")
        disk.write_durable(cut / "jobs")
        (cut / "acks").write_bytes(acks)
        shutil.copy(home / "calibration.json", cut / "calibration.json")
        yield f"power cut after call {calls} ({kind} {pathlib.Path(path).name})", rig.recovers(cut)


def bad_disks(rig, numbers, seed=5, failures=0):
    """A disk that is full, read-only or failing from each of these calls on, or for this many calls. The cause must be
    named, no acknowledged view may be lost, and with a good disk the job must come to its model. A single failure while
    the model was written leaves a failed job: its model is requested again."""
    chance = random.Random(seed)
    for number in numbers:
        error = chance.choice([errno.ENOSPC, errno.EROFS, errno.EIO])
        home = rig.fresh("bad_disk")
        end = rig.run("scan", home, fail=number, error=error, failures=failures)
        what = f"{errno.errorcode[error]} from call {number}, {failures or 'all'} of them"
        if end.returncode not in (0, 1):
            yield what, f"the daemon ended with {end.returncode}: {end.stdout}{end.stderr}"
        elif end.returncode == 1 and os.strerror(error) not in end.stdout:
            yield what, f"not told by its name: {end.stdout}"
        else:
            yield what, rig.recovers(home, again=failures > 0)


def crashes(rig):
    """A model whose reconstruction kills the daemon: tried twice, then quarantined; the station continues."""
    home = rig.fresh("crash")
    for verb in ("scan", "recover"):
        end = rig.run(verb, home, crash=True)
        if end.returncode != -11:
            yield f"{verb} with a stage that crashes", f"ended with {end.returncode}: {end.stdout}{end.stderr}"
            return
    end = rig.run("recover", home, crash=True)
    said = "quarantined" in end.stdout and "lost" not in end.stdout
    yield "the third start leaves the job alone", None if said else f"{end.returncode}: {end.stdout}{end.stderr}"
    end = rig.run("scan", home)
    yield "the next job runs", None if end.returncode == 0 else f"{end.returncode}: {end.stdout}{end.stderr}"


def damaged_index(rig, home, count, seed=4):
    """The index deleted, cut short or overwritten; nothing may be lost."""
    chance = random.Random(seed)
    index = home / "jobs" / "index.sqlite"
    for number in range(count):
        rig.recovers(home)
        how = number % 3
        if how == 0:
            index.unlink()
        elif how == 1:
            whole = index.read_bytes()
            index.write_bytes(whole[:chance.randrange(len(whole))])
        else:
            whole = bytearray(index.read_bytes())
            for _ in range(50):
                whole[chance.randrange(len(whole))] = chance.randrange(256)
            index.write_bytes(whole)
        yield f"index {('deleted', 'cut short', 'overwritten')[how]}", rig.recovers(home)


def measure(bench, scratch):
    rig = Rig(bench.bin, scratch)
    home, log = rig.record()
    calls = calls_of(log)
    bench.note(f"one job changes its files by {len(calls)} calls of {len({call[0] for call in calls})} kinds")
    each = "every" if bench.long and not bench.quick else "a sampled"
    some = bench.pick(full=None, sampled=40, quick=24)
    kill = kill_points(calls, bench.pick(full=None, sampled=60, quick=48), seed=1)
    report(bench, f"SIGKILL before and after {each} write, fsync, rename of a job", kills(rig, kill), len(kill),
           of=2 * len(calls))
    count = bench.pick(full=120, sampled=20, quick=10)
    report(bench, "SIGKILL at random moments", random_kills(rig, count), count, of=120)
    count = bench.pick(full=300, sampled=30, quick=30)
    report(bench, "SIGKILL again during the recovery", second_kills(rig, len(calls), count), count, of=300)
    for what, seed, points in (
            (f"power cut after {each} write, fsync, rename of a job", 3, lambda at: power_cuts(rig, home, log, at)),
            (f"full, read-only and failing disk from {each} call on, then a good one", 5, lambda at: bad_disks(rig, at)),
            (f"a disk that fails once, at {each} call", 7, lambda at: bad_disks(rig, at, seed=7, failures=1))):
        numbers = call_numbers(calls, some, seed)
        report(bench, what, points(numbers), len(numbers), of=len(calls))
    report(bench, "a reconstruction that takes the daemon with it, twice", crashes(rig), 2, of=2,
           asked="quarantine after the second, next job runs")
    count = bench.pick(full=100, sampled=15, quick=10)
    report(bench, "index deleted, cut short, overwritten", damaged_index(rig, home, count), count, of=100)


NOTHING_LOST = "0 acknowledged views lost, 0 unreadable folders, 0 jobs without an end"
ENOUGH = 0.9  # of the planned points: a kill may come after the end of the job


def report(bench, what, points, planned, of, asked=NOTHING_LOST):
    """A line with the results at the points; `of` is the number of points with --long."""
    faults, done = [], 0
    for where, fault in bench.in_time(points):
        done += 1
        if fault:
            faults.append(f"{where}: {fault}")
    for fault in faults[:10]:
        bench.note(fault)
    counted = f"{done} points" if planned >= of else f"{done} of {of} points"
    bench.line(what, asked, f"{len(faults)} faults at {counted}", done >= ENOUGH * planned and not faults)
