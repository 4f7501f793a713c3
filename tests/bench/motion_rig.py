"""The simulated rig on the wire, the daemon beside it, and the operator's actions, for the groups of the bench."""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

READY_S = 10
DAEMON_READY_S = 60
TAP_S = 0.2  # like a hand; the panel debounces for 50 ms

# First bytes of a frame that starts or ends a motion, after the unit id if any [manuals of the drives; GRBL 1.1].
MOTIONS = {
    "leadshine-rs": {"10 62 00": "move", "06 60 02 00 20": "home", "06 60 02 00 40": "stop"},
    "oriental-az": {"10 00 58": "move", "06 00 7D 00 10": "home", "06 00 7D 00 20": "stop"},
    "grbl": {"47": "move", "24 48": "home", "21": "stop", "18": "stop"},  # G, $H, !, 0x18
}
DRIVES = tuple(MOTIONS)


class Rig:
    """One `scanrig-sim rig` in a folder of its own."""

    def __init__(self, binaries, folder, *options):
        self.bin = pathlib.Path(binaries)
        self.drive = options[options.index("--drive") + 1] if "--drive" in options else DRIVES[0]
        self.folder = pathlib.Path(folder)
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self.config = self.folder / "rig.toml"
        self.api = self.folder / "api.sock"
        self.log = open(self.folder / "rig.log", "w")
        command = [self.bin / "scanrig-sim", "rig", "--dir", self.folder, *options]
        self.process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=self.log,
                                        text=True)
        if "ready" not in self.process.stdout.readline():
            raise RuntimeError(f"the simulated rig did not start, see {self.folder / 'rig.log'}")
        self.peer = socket.socket(socket.AF_UNIX)
        self.peer.connect(str(self.folder / "control.sock"))
        self.lines = self.peer.makefile("r")
        self.daemon = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill_daemon(signal.SIGKILL)
        self.process.terminate()
        self.process.wait(timeout=10)

    def request(self, **request):
        self.peer.sendall((json.dumps(request) + "\n").encode())
        answer = json.loads(self.lines.readline())
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer

    def truth(self):
        return self.request(get="truth")

    def set(self, **knobs):
        return self.request(set=knobs)["at_ns"]

    def press(self, name):
        return self.request(press=name)["at_ns"]

    def release(self, name):
        return self.request(release=name)["at_ns"]

    def tap(self, name):
        self.press(name)
        time.sleep(TAP_S)
        self.release(name)

    def frames(self, since=0):
        """Frames from number `since` on, and the number to continue from."""
        found = []
        while True:
            answer = self.request(get="frames", since=since)
            if not answer["frames"]:
                return found, since
            found += answer["frames"]
            since = answer["next"]

    def kind(self, frame):
        """"move", "home", "stop" or "" for a frame that the drive received."""
        if not frame["from_master"]:
            return ""
        words = frame["bytes"] if self.drive == "grbl" else frame["bytes"][3:]
        return next((what for begins, what in MOTIONS[self.drive].items() if words.startswith(begins)), "")

    def edit_config(self, before, after):
        text = self.config.read_text()
        if before not in text:
            raise RuntimeError(f"{self.config} has no {before}")
        self.config.write_text(text.replace(before, after))

    # The daemon

    def start_daemon(self, scale=0.25, wait=True, environment=None):
        """For a daemon that simulates its cameras itself, at this scale."""
        self.run_daemon([self.bin / "scanrigd-sim", "--scale", scale], wait, environment)

    def start_shipped_daemon(self, wait=True):
        """For a rig whose cameras are simulated on the wire."""
        self.run_daemon([self.bin / "scanrigd"], wait)

    def run_daemon(self, program, wait, environment=None):
        self.api.unlink(missing_ok=True)
        output = open(self.folder / "daemon.log", "a")
        command = [*program, "--config", self.config]
        self.daemon = subprocess.Popen([str(word) for word in command], stdout=output, stderr=output,
                                       env=dict(os.environ, **(environment or {})))
        if wait and not self.wait(self.asks_for_reset, DAEMON_READY_S):
            raise RuntimeError(f"the daemon did not start, see {self.folder / 'daemon.log'}")

    def kill_daemon(self, number):
        if self.daemon and self.daemon.poll() is None:
            self.daemon.send_signal(number)
            try:
                self.daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                self.daemon.kill()
                self.daemon.wait()
        self.daemon = None

    def make_safe(self):
        """Runs make-safe like systemd's ExecStopPost= after the daemon's end."""
        return subprocess.run([self.bin / "scanrigd-sim", "--make-safe", "--config", self.config],
                              capture_output=True, text=True, timeout=20)

    def ask(self, target="status"):
        """A GET of the daemon's API; None without a reply."""
        try:
            with socket.socket(socket.AF_UNIX) as peer:
                peer.settimeout(5)
                peer.connect(str(self.api))
                peer.sendall(f"GET /api/v1/{target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
                parts = []
                while part := peer.recv(65536):
                    parts.append(part)
            return json.loads(b"".join(parts).split(b"\r\n\r\n", 1)[1])
        except (OSError, ValueError, IndexError):
            return None

    def status(self):
        return self.ask()

    def wait(self, ready, limit_s, pause_s=0.02):
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            if ready():
                return True
            time.sleep(pause_s)
        return False

    def machine_is(self, state):
        status = self.status()
        return status is not None and status["machine"] == state

    def asks_for_reset(self):
        return "Reset" in (self.status() or {}).get("next_action", "")

    def get_ready(self, limit_s=30):
        """Presses Reset at the panel until the table is homed."""
        self.wait(self.asks_for_reset, limit_s)
        self.tap("reset")
        return self.wait(lambda: self.machine_is("Operational.Ready"), limit_s)
