"""A daemon over the simulated rig in its own process, accessed over its API."""
import json
import os
import pathlib
import subprocess
import time

import sigkill

LIMIT_S = 120
TRIES = 3
ENDED = ("done", "failed", "interrupted", "cancelled")


def order(socket, method, target):
    """Status of the reply, 0 without a reply, and its text."""
    try:
        connection = sigkill.UnixConnection(socket)
        connection.request(method, "/api/v1/" + target)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    except OSError as error:
        return 0, str(error)


class Daemon:
    """Jobs in home/jobs; a helper turns objects over and fixes faults, everything else is requested here."""

    def __init__(self, binaries, home, *options, environment=None):
        self.home, self.jobs, self.socket = home, home / "jobs", home / "api.sock"
        self.jobs.mkdir(parents=True, exist_ok=True)
        command = [pathlib.Path(binaries) / "scanrigd-sim", "--socket", self.socket, "--jobs", self.jobs,
                   "--operator", "helper", *options]
        with open(home / "daemon.log", "a") as log:
            self.process = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log,
                                            env=dict(os.environ, **(environment or {})))
        self.unanswered = 0
        self.wait(self.status, "the daemon does not answer")
        self.unanswered = 0

    def ask(self, target):
        """None without a reply, after several attempts."""
        for _ in range(TRIES):
            if (answer := sigkill.ask(self.socket, target)) is not None:
                return answer
            self.unanswered += 1
        return None

    def status(self):
        return self.ask("status")

    def order(self, method, target):
        return order(self.socket, method, target)

    def job(self):
        """The newest job."""
        jobs = (self.ask("jobs?limit=1") or {"jobs": []})["jobs"]
        return self.ask("jobs/" + jobs[0]["id"]) if jobs else None

    def wait(self, seen, otherwise, limit_s=LIMIT_S):
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            if found := seen():
                return found
            time.sleep(0.02)
        raise TimeoutError(f"{otherwise}: {json.dumps(self.status())}")

    def wait_ready(self):
        self.wait(lambda: (self.status() or {}).get("machine") == "Operational.Ready", "the station does not get ready")

    def start(self):
        """Gives the rig to the head of the queue, or to a new job."""
        self.wait_ready()
        status, words = self.order("POST", "start")
        if status != 200:
            raise TimeoutError(f"start is refused: {words}")

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return "the daemon did not end"
        return ""
