"""Kills a daemon before and after every call by which it changes its files, and cuts the power there; then starts again.

The job is a two-pose job of three views over devices that only pretend (tests/bench/station/one_job.cpp): all of the
daemon's own file handling, in a fraction of a second. After each start every job found must come to its end, by resuming
or by being ended, and every view that was acknowledged must be there and whole.
"""
import errno
import os
import pathlib
import random
import shutil
import subprocess

import station_disk
from slowness import SLOWNESS

LIMIT_S = 60 * SLOWNESS


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
        """None, or what is wrong. `again`: somebody asks for the model of a job that failed once more."""
        done = self.run("recover", home, again=again)
        return None if done.returncode == 0 else (done.stdout + done.stderr).strip().replace("\n", "; ")

    def record(self):
        """The log of one whole job."""
        home = self.fresh("record")
        log = self.home / "log"
        done = self.run("scan", home, log=log, acks=home / "acks")
        if done.returncode != 0:
            raise RuntimeError(f"the job cannot be done at all: {done.stdout}{done.stderr}")
        return home, list(station_disk.read_log(log))


def one_kill(rig, number, when):
    """SIGKILL before or after the `number`-th call. Returns what is wrong, or None; and whether the kill took place."""
    home = rig.fresh("killed")
    end = rig.run("scan", home, kill=number, when=when)
    if end.returncode not in (0, -9):
        return f"the daemon ended with {end.returncode}: {end.stdout}{end.stderr}", False
    return rig.recovers(home), end.returncode == -9


def kills(rig, calls, share=1.0, seed=1):
    """Yields (what, fault or None) for the calls, both sides of each; `share` of them by chance."""
    points = [(n, when) for n in range(1, calls + 1) for when in ("before", "after")]
    if share < 1:
        points = random.Random(seed).sample(points, max(1, round(share * len(points))))
    for number, when in points:
        fault, killed = one_kill(rig, number, when)
        if killed:
            yield f"killed {when} call {number}", fault


def random_kills(rig, count, seed=6):
    """SIGKILL at any moment, also between two calls."""
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
        # Too early for a calibration there is no rig at all.
        if (home / "calibration.json").exists():
            yield f"killed after {1000 * after:.0f} ms", rig.recovers(home)


def second_kills(rig, calls, count, seed=2):
    """A second kill during the recovery from a first one: both may have come while the model was made."""
    chance = random.Random(seed)
    for _ in range(count):
        first, second = chance.randint(1, calls), chance.randint(1, calls)
        home = rig.fresh("killed_twice")
        rig.run("scan", home, kill=first, when="after")
        rig.run("recover", home, kill=second, when="after")
        yield f"killed after call {first} and after call {second} of the recovery", rig.recovers(home, again=True)


def power_cuts(rig, home, log, share=1.0, seed=3):
    """Yields (what, fault or None) for a power cut after each of the logged calls."""
    disk, acks, calls = station_disk.Disk(str(home / "jobs")), b"", 0
    chance = random.Random(seed)
    for kind, path, other, data in log:
        if kind == "ack":
            acks += data
            continue
        disk.apply(kind, path, other, data)
        calls += 1
        if chance.random() > share:
            continue
        cut = rig.fresh("cut")
        shutil.rmtree(cut / "jobs")
        disk.write_durable(cut / "jobs")
        (cut / "acks").write_bytes(acks)
        shutil.copy(home / "calibration.json", cut / "calibration.json")
        yield f"power cut after call {calls} ({kind} {pathlib.Path(path).name})", rig.recovers(cut)


def bad_disks(rig, calls, share=1.0, seed=5, failures=0):
    """A disk that is full, read-only or failing from some call on, or for so many calls: that must be named, nothing
    that was acknowledged may be lost, and with a good disk the job must come to its model. One that failed alone while
    that was written failed the job: somebody asks again."""
    chance = random.Random(seed)
    for number in range(1, calls + 1):
        if chance.random() > share:
            continue
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
    """A model whose making kills the daemon: tried twice, then in quarantine; the station goes on."""
    home = rig.fresh("crash")
    for verb in ("scan", "recover"):
        end = rig.run(verb, home, crash=True)
        if end.returncode != -11:
            yield f"{verb} with a stage that crashes", f"ended with {end.returncode}: {end.stdout}{end.stderr}"
            return
    end = rig.run("recover", home, crash=True)
    said = "in quarantine" in end.stdout and "lost" not in end.stdout
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
    calls = sum(1 for entry in log if entry[0] != "ack")
    share = 0.1 if bench.quick else 1.0
    bench.note(f"one job changes its files by {calls} calls")
    count = 30 if bench.quick else 300
    report(bench, "SIGKILL before and after every write, fsync, rename of a job", kills(rig, calls, share))
    report(bench, "SIGKILL at random moments", random_kills(rig, 10 if bench.quick else 120))
    report(bench, "SIGKILL again during the recovery", second_kills(rig, calls, count))
    report(bench, "power cut after every write, fsync, rename of a job", power_cuts(rig, home, log, share))
    report(bench, "full, read-only and failing disk from every call on, then a good one", bad_disks(rig, calls, share))
    report(bench, "a disk that fails once, at every call", bad_disks(rig, calls, share, seed=7, failures=1))
    report(bench, "a reconstruction that takes the daemon with it, twice", crashes(rig),
           "quarantine after the second, next job runs")
    report(bench, "index deleted, cut short, overwritten", damaged_index(rig, home, count // 3))


NOTHING_LOST = "0 acknowledged views lost, 0 unreadable folders, 0 jobs without an end"


def report(bench, what, points, asked=NOTHING_LOST):
    faults, done = [], 0
    for where, fault in points:
        done += 1
        if fault:
            faults.append(f"{where}: {fault}")
    for fault in faults[:10]:
        bench.note(fault)
    bench.line(what, asked, f"{len(faults)} faults at {done} points", done > 0 and not faults)
