"""A daemon killed at random times during a scan: acknowledged data are still there, and the job is interrupted."""
import hashlib
import http.client
import json
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import time

START_LIMIT_S = 60
VIEWS = 4  # per pose


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost", timeout=10)
        self.path = str(path)

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)


def ask(path, target):
    """JSON of the reply, or None without a reply."""
    try:
        connection = UnixConnection(path)
        connection.request("GET", "/api/v1/" + target)
        return json.loads(connection.getresponse().read())
    except (OSError, http.client.HTTPException, ValueError):
        return None


def start(binaries, home, operator):
    with open(home / "daemon.log", "a") as log:
        return subprocess.Popen(
            [str(binaries / "scanrigd-sim"), "--socket", str(home / "api.sock"), "--jobs", str(home / "jobs"), "--scale",
             "0.25", "--views", str(VIEWS), "--clock", "virtual", "--operator", operator, "--voxel-mm", "1"],
            stdout=log, stderr=log)


def acknowledged(home, at_least, limit_s=START_LIMIT_S):
    """The only job as the daemon reports it, once this many of its views are acknowledged."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        jobs = ask(home / "api.sock", "jobs")
        if jobs and jobs["jobs"] and jobs["jobs"][0]["stored"] >= at_least:
            return ask(home / "api.sock", "jobs/" + jobs["jobs"][0]["id"])
    return None


def lost_views(job):
    """Names of the views of `job` whose files on disk do not match the manifest."""
    folder = pathlib.Path(job["folder"])
    scan = json.loads((folder / "scan.json").read_text())
    lost = []
    for stored in job["stored"]:
        views = scan["poses"][stored["pose"]]["views"] if stored["pose"] < len(scan["poses"]) else []
        view = next((v for v in views if v["index"] == stored["view"]), None)
        files = view["files"].values() if view else []
        whole = all(hashlib.sha256((folder / f["path"]).read_bytes()).hexdigest() == f["sha256"] for f in files)
        if not view or not whole:
            lost.append(f"pose {stored['pose'] + 1} view {stored['view']}")
    return lost


def one_kill(binaries, home, views, delay):
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    daemon = start(binaries, home, "auto")
    try:
        before = acknowledged(home, views)
        time.sleep(delay)
        before = acknowledged(home, views) or before
    finally:
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
    if before is None:
        return False, "the daemon took no views"
    daemon = start(binaries, home, "none")
    try:
        after = acknowledged(home, 0)
    finally:
        daemon.terminate()
        daemon.wait(timeout=20)
    if after is None:
        return False, "the daemon did not come back with the job"
    lost = lost_views(before)
    scanning = before["state"] in ("scanning", "waiting_for_flip")
    fine = not lost and (after["state"] == "interrupted" or not scanning)
    return fine, f"{len(before['stored'])} acknowledged, {len(lost)} lost, then {after['state']}"


def cases(binaries, scratch, kills):
    """Yields (name, ok, what was seen) for each kill."""
    home = pathlib.Path(scratch).resolve() / "sigkill"
    chance = random.Random(1)
    for kill in range(kills):
        views, delay = chance.randint(1, 2 * VIEWS - 1), chance.uniform(0.0, 0.2)
        ok, seen = one_kill(pathlib.Path(binaries).resolve(), home, views, delay)
        yield f"kill {kill + 1}, after view {views}", ok, seen
