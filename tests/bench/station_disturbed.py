"""A disk that is full, read-only or slow, and a wall clock that jumps, under a scanning daemon.

Each trial runs this file again in a mount namespace of its own. There the job folder is a small file system in
memory that can be filled, locked and released without changes to the machine's disks.
"""
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import time

import sigkill
import station_daemon

VIEWS = 4
DISK_MIB = 192  # a job does not start without room for its model
HOUR_S = 3600
SLOW_FSYNC_MS = 400
TRIAL_LIMIT_S = 600
ASKED = "named, nothing lost, no Reset asked for, goes on when the cause is gone"


class Station(station_daemon.Daemon):
    """Daemon with its jobs on a file system of its own."""

    def __init__(self, binaries, home):
        jobs, self.knobs = home / "jobs", home / "disturb"
        jobs.mkdir(parents=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", jobs], check=True)
        self.disturb()
        super().__init__(binaries, home, "--scale", "0.25", "--views", VIEWS, "--voxel-mm", "1", "--threads", "2",
                         environment={"LD_PRELOAD": str(binaries / "disturb.so"), "SCANRIG_DISTURB": str(self.knobs)})

    def disturb(self, fsync_ms=0, ahead_s=0):
        with open(self.knobs, "r+b" if self.knobs.exists() else "wb") as file:
            file.write(struct.pack("=qq", fsync_ms, ahead_s))

    def fill(self):
        """Fills the rest of the disk."""
        with open(self.jobs / "ballast", "wb", buffering=0) as ballast:
            for block in (1 << 20, 4096, 1):
                try:
                    while True:
                        ballast.write(b"\0" * block)
                except OSError:
                    pass

    def make_room(self):
        (self.jobs / "ballast").unlink()

    def remount(self, how):
        subprocess.run(["mount", "-o", f"remount,{how}", self.jobs], check=True)

    def begin(self, views=1):
        """A job with this many views acknowledged."""
        self.start()
        self.wait(lambda: (self.job() or {"stored": []})["stored"][views - 1:], "no view is acknowledged")

    def finish(self):
        return self.wait(lambda: (job := self.job())["state"] in station_daemon.ENDED and job, "the job does not end")


def takes_nothing(station, spoil, mend, words):
    """The disk fails in the middle of a scan; returns the failures and the observations."""
    wrongs = []
    station.begin(views=2)
    spoil()
    ended = station.finish()
    status = station.status()
    told = " ".join([str(ended["error"]), status["cause"], status["next_action"]])
    if ended["state"] != "interrupted" or words not in told or "Check the job disk" not in status["next_action"]:
        wrongs.append(f"the job ends {ended['state']}, told: {told}")
    if status["machine"] == "Error":
        wrongs.append(f"a fault is latched: {status['cause']}")
    mend()
    wrongs += [f"lost {name}" for name in sigkill.lost_views(ended)]
    kept = len(ended["stored"])
    status, refused = station.order("POST", f"jobs/{ended['id']}/resume")
    if status != 200:
        return wrongs + [f"resume is refused: {refused}"], ""
    station.start()
    station.wait(lambda: station.job()["state"] == "scanning", "the job is not gone on with")
    again = station.finish()
    if again["id"] != ended["id"] or again["state"] != "done":
        wrongs.append(f"resumed, the job ends {again['state']}: {again['error']}")
    wrongs += [f"lost after all {name}" for name in sigkill.lost_views(ended)]
    return wrongs, f"{kept} views kept, \"{words}\", resumed, done"


def full(station):
    return takes_nothing(station, station.fill, station.make_room, "No space left on device")


def read_only(station):
    return takes_nothing(station, lambda: station.remount("ro"), lambda: station.remount("rw"), "Read-only file system")


def slow(station):
    station.begin()
    station.disturb(fsync_ms=SLOW_FSYNC_MS)
    begun = time.monotonic()
    ended = station.finish()
    took = time.monotonic() - begun
    station.disturb()
    wrongs = [f"lost {name}" for name in sigkill.lost_views(ended)]
    if ended["state"] != "done":
        wrongs.append(f"the job ends {ended['state']}: {ended['error']}")
    return wrongs, f"{SLOW_FSYNC_MS} ms a sync: job done after {took:.0f} s"


def clock_jumps(station):
    station.begin()
    for ahead_s in (HOUR_S, -HOUR_S):
        station.disturb(ahead_s=ahead_s)
        stored = len(station.job()["stored"])
        station.wait(lambda: len(station.job()["stored"]) > stored or station.job()["state"] != "scanning",
                     "the scan stands still")
    ended = station.finish()
    station.disturb()
    scan = json.loads((pathlib.Path(ended["folder"]) / "scan.json").read_text())
    odd = [view for pose in scan["poses"] for view in pose["views"]
           if not 0 <= view["moving_ms"] < 60000 or not 0 <= view["settling_ms"] < 60000]
    wrongs = [f"lost {name}" for name in sigkill.lost_views(ended)] + [f"odd times of view {v['index']}" for v in odd]
    if ended["state"] != "done":
        wrongs.append(f"the job ends {ended['state']}: {ended['error']}")
    return wrongs, "an hour forth, two back: job done, times sound"


TRIALS = {"full disk": full, "read-only disk": read_only, "slow disk": slow, "clock jump": clock_jumps}


def inside(binaries, home, name):
    """Runs one trial in the namespace; prints the observations."""
    station = None
    try:
        station = Station(binaries, home)
        wrongs, seen = TRIALS[name](station)
    except (TimeoutError, KeyError, TypeError, subprocess.CalledProcessError) as error:
        wrongs, seen = [f"{type(error).__name__}: {error}"], ""
    if station and (not_ended := station.end()):
        wrongs.append(not_ended)
    print(json.dumps({"wrongs": wrongs, "seen": seen}))


def measure(bench, scratch):
    for name in TRIALS:
        home = scratch / name.replace(" ", "-")
        shutil.rmtree(home, ignore_errors=True)
        command = ["unshare", "--mount", "--map-root-user", sys.executable, __file__, bench.bin, home, name]
        done = bench.run(command, TRIAL_LIMIT_S)
        if done.returncode != 0 or not done.stdout.startswith("{"):
            said = (done.stderr.strip().splitlines() or ["no answer"])[-1]
            bench.line(name, ASKED, f"not measured: {said}", None)
            continue
        told = json.loads(done.stdout.splitlines()[-1])
        bench.line(name, ASKED, "; ".join(told["wrongs"]) or told["seen"], not told["wrongs"])


if __name__ == "__main__":
    inside(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3])
