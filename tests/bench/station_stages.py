"""Stages that segfault, throw or take all memory, in the daemon's process and in their own, on the wire rig."""
import resource
import signal
import time

import motion_rig
import station_daemon

OPTIONS = ("--poses", "1", "--views", "4", "--voxel-mm", "1", "--speed-deg-s", "90", "--acceleration-deg-s2", "400")
AS_SHIPPED = 'executor = "in_process"\nmemory_gib = 6'
MEMORY_GIB = 2
SAFE_LIMIT_S = 1.0
JOB_LIMIT_S = 120
WORDS = {"process": {"segv": "Segmentation fault", "throw": "a stage that throws", "eat": "memory"},
         "in_process": {"throw": "a stage that throws", "eat": "ran out of memory"}}


class Trial:
    def __init__(self, rig, executor):
        self.rig, self.knob = rig, rig.folder / "sick"
        self.be_sick("")
        rig.edit_config(AS_SHIPPED, f'executor = "{executor}"\nmemory_gib = {MEMORY_GIB}')
        self.boot()

    def boot(self):
        """A daemon whose table is homed."""
        self.start_daemon()
        self.rig.get_ready()

    def start_daemon(self, wait=True):
        """Limits its memory, like systemd's MemoryMax=."""
        self.rig.start_daemon(wait=wait, environment={"LD_PRELOAD": str(self.rig.bin / "sick_stage.so"),
                                                      "SICK_STAGE": str(self.knob)})
        limit = MEMORY_GIB << 30
        resource.prlimit(self.rig.daemon.pid, resource.RLIMIT_DATA, (limit, limit))

    def be_sick(self, how):
        self.knob.write_text(how)

    def job(self):
        jobs = (self.rig.ask("jobs?limit=1") or {"jobs": []})["jobs"]
        return jobs[0] if jobs else None

    def scan(self):
        """A job to its end; None if it does not end."""
        before = (self.job() or {}).get("id")
        self.rig.wait(lambda: self.rig.machine_is("Operational.Ready"), JOB_LIMIT_S)
        self.rig.tap("start")
        over = self.rig.wait(lambda: (j := self.job()) and j["id"] != before and j["state"] in station_daemon.ENDED,
                             JOB_LIMIT_S)
        return self.job() if over else None

    def scan_to_death(self):
        """Presses Start; makes the rig safe like systemd if the daemon dies. Seconds from death to stopped and dark."""
        self.rig.wait(lambda: self.rig.machine_is("Operational.Ready"), JOB_LIMIT_S)
        self.rig.tap("start")
        if not self.dies():
            return None
        died = time.monotonic()
        self.rig.make_safe()
        safe = self.rig.wait(lambda: (t := self.rig.truth())["stopped"] and not t["projector_on"], 10, 0.005)
        return time.monotonic() - died if safe else None

    def dies(self):
        return self.rig.wait(lambda: self.rig.daemon.poll() is not None, JOB_LIMIT_S, 0.002)

    def next_job_is_done(self):
        self.be_sick("")
        job = self.scan()
        return [] if job and job["state"] == "done" else [f"the next job ends {job and job['state']}"]


def is_survived(trial, how, words):
    """The stage costs its job, and the daemon nothing; returns the failure."""
    daemon = trial.rig.daemon.pid
    trial.be_sick(how)
    job = trial.scan()
    if not job or job["state"] != "failed":
        return [f"the job ends {job and job['state']}"]
    wrongs = [] if words in job["error"]["message"] else [f"told as: {job['error']['message']}"]
    if not trial.rig.wait(lambda: trial.rig.machine_is("Operational.Ready"), JOB_LIMIT_S):
        wrongs.append(f"the rig is not free: {trial.rig.status()}")
    if trial.rig.daemon.poll() is not None or trial.rig.daemon.pid != daemon:
        return wrongs + ["the daemon is dead"]
    return wrongs + trial.next_job_is_done()


def deaths(trial):
    """A segmentation fault in the daemon's own process, during a scan and twice over its model; returns the failure
    and the seconds until safe."""
    trial.be_sick("segv")
    wrongs, safe_s = [], [trial.scan_to_death()]
    if trial.rig.daemon.returncode != -signal.SIGSEGV:
        return [f"the daemon ended with {trial.rig.daemon.returncode}"], safe_s
    trial.boot()
    job = trial.job()
    status, refused = station_daemon.order(trial.rig.api, "POST", f"jobs/{job['id']}/resume")
    if status != 200:
        return wrongs + [f"the job is {job['state']}, resume is refused: {refused}"], safe_s
    # The fault is the same; but now the views are taken alone, and the model is made of all of them.
    safe_s.append(trial.scan_to_death())
    trial.start_daemon(wait=False)
    if not trial.dies() or trial.rig.daemon.returncode != -signal.SIGSEGV:
        return wrongs + [f"the daemon ended with {trial.rig.daemon.returncode}"], safe_s
    trial.boot()
    told = trial.job()
    if trial.rig.daemon.poll() is not None or "quarantine" not in str(told["error"]):
        wrongs.append(f"no quarantine: {told['state']}, {told['error']}")
    return wrongs + trial.next_job_is_done(), safe_s


def measure(bench, scratch):
    for executor, words in WORDS.items():
        with motion_rig.Rig(bench.bin, scratch / f"stages_{executor}", *OPTIONS) as rig:
            trial = Trial(rig, executor)
            for how, told in words.items():
                wrongs = is_survived(trial, how, told)
                bench.line(f"a stage that does \"{how}\", executor {executor}", "named, rig free, next job runs",
                           "; ".join(wrongs) or "so it is", not wrongs)
            if executor == "process":
                continue
            wrongs, safe_s = deaths(trial)
            bench.line("a stage that segfaults with the daemon, in the scan and twice over the model",
                       "then quarantine, next job runs", "; ".join(wrongs) or "so it is", not wrongs)
            worst = None if not safe_s or None in safe_s else max(safe_s)
            bench.at_most("rig safe after such a death", SAFE_LIMIT_S, worst, "s", 2)
