"""A shift without end: hundreds of two-pose jobs with faults in between; memory and descriptors that the daemon keeps.

Over the simulated rig on the virtual clock. 2 % of the exposures meet a fault (a lost frame, a silent camera, a blocked
table, the e-stop). The simulated operator fixes it, and the interrupted job is resumed.
"""
import concurrent.futures
import pathlib
import statistics
import time

import station_daemon

TROUBLE = 0.02
KEPT_JOBS = 20  # on disk: older ones are deleted, as by retention
JOB_LIMIT_S = 300
GROWTH_LIMIT_PERCENT = 2
PARTS = {"low-resolution": (500, ("--scale", "0.15", "--views", "4", "--voxel-mm", "3", "--threads", "2")),
         "full-size": (20, ("--views", "8", "--threads", "2"))}
SAMPLED = {"low-resolution": 80, "full-size": 2}
QUICK = {"low-resolution": 16, "full-size": 1}


def memory_kib(pid):
    """Resident size: the share of memory common to two daemons (PSS) would rise when the other one ends."""
    rollup = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    return next(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Rss:"))


def descriptors(pid):
    return len(list(pathlib.Path(f"/proc/{pid}/fd").iterdir()))


class Shift:
    def __init__(self, daemon):
        self.daemon, self.resumed, self.ended = daemon, 0, {}
        self.memory, self.open = [], []

    def one_job(self):
        """A job from Start to the end, however often it is interrupted; returns its result."""
        daemon, before = self.daemon, (self.daemon.job() or {}).get("id")
        daemon.start()
        job = daemon.wait(lambda: (j := daemon.job()) and j["id"] != before and j, "no new job", JOB_LIMIT_S)
        while (job := self.follow(job["id"]))["state"] == "interrupted" and job["resumable"]:
            self.resumed += 1
            status, words = daemon.order("POST", f"jobs/{job['id']}/resume")
            if status != 200:
                raise TimeoutError(f"resume is refused: {words}")
            daemon.start()
            daemon.wait(lambda: daemon.ask("jobs/" + job["id"])["state"] != "queued", "the job is not resumed", JOB_LIMIT_S)
        return job

    def follow(self, job):
        return self.daemon.wait(lambda: (j := self.daemon.ask("jobs/" + job))["state"] in station_daemon.ENDED and j,
                                f"job {job} does not end", JOB_LIMIT_S)

    def work(self, jobs):
        for _ in jobs:
            job = self.one_job()
            self.ended[job["state"]] = self.ended.get(job["state"], 0) + 1
            self.memory.append(memory_kib(self.daemon.process.pid))
            self.open.append(descriptors(self.daemon.process.pid))
            self.remove_old()

    def remove_old(self):
        jobs = self.daemon.ask("jobs?limit=100")["jobs"]
        for job in jobs[KEPT_JOBS:]:
            self.daemon.order("DELETE", "jobs/" + job["id"])


def job_count(bench, part):
    return bench.pick(full=PARTS[part][0], sampled=SAMPLED[part], quick=QUICK[part])


def soak(bench, scratch, part):
    """Observations of the shift, seconds, and the cause of an early end or ''."""
    _, options = PARTS[part]
    home = scratch / f"soak_{part}"
    begun, stuck = time.monotonic(), ""
    daemon = station_daemon.Daemon(bench.bin, home, "--clock", "virtual", "--trouble", TROUBLE, *options)
    shift = Shift(daemon)
    try:
        shift.work(bench.in_time(range(job_count(bench, part))))
    except (TimeoutError, KeyError, TypeError, OSError) as error:
        stuck = f"{type(error).__name__}: {error}"
    return shift, time.monotonic() - begun, daemon.end() or stuck


def quarters(values):
    """Medians of the second and the last quarter."""
    n = len(values) // 4
    return statistics.median(values[n:2 * n]), statistics.median(values[-n:])


def report(bench, part, shift, seconds, stuck):
    jobs = sum(shift.ended.values())
    wanted = job_count(bench, part)
    told = ", ".join(f"{count} {state}" for state, count in sorted(shift.ended.items()))
    bench.note(f"{part}: {seconds / max(1, jobs):.1f} s a job, {shift.resumed} interruptions resumed, "
               f"{shift.daemon.unanswered} requests without an answer")
    bench.line(f"soak, {wanted} {part} jobs, {100 * TROUBLE:.0f} % of exposures in trouble", "all end, no stuck state",
               "; ".join(filter(None, [told, stuck])), not stuck and jobs == wanted)
    what = f"soak, {part}: memory, last quarter against second"
    if len(shift.memory) < 8:
        bench.line(what, f"<= {GROWTH_LIMIT_PERCENT} %", f"not measured: {len(shift.memory)} jobs are too few", None)
        return
    before, after = quarters(shift.memory)
    course = ", ".join(f"{kib / 1024:.0f}" for kib in shift.memory[::max(1, len(shift.memory) // 20)])
    bench.note(f"{part}: {before / 1024:.0f} MiB, then {after / 1024:.0f} MiB; over the jobs: {course}")
    bench.at_most(what, GROWTH_LIMIT_PERCENT, 100 * (after / before - 1), "%", 1)
    before, after = quarters(shift.open)
    bench.line(f"soak, {part}: descriptors", "flat", f"{before:.0f}, then {after:.0f}", after <= before)


def measure(bench, scratch, parts=tuple(PARTS)):
    """Runs both parts at once; by command line each alone."""
    with concurrent.futures.ThreadPoolExecutor(len(parts)) as pool:
        for part, seen in zip(parts, pool.map(lambda part: soak(bench, scratch, part), parts)):
            report(bench, part, *seen)
