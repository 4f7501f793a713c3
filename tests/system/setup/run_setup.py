#!/usr/bin/env python3
"""`scanrig setup` at the simulated wired rig, with a person who presses what it asks for, until a job is scanned.

Usage: run_setup.py BIN KIND, inside `scanrig-sim own-network`. Exits 1 with what was not as it should be.
"""
import contextlib
import json
import os
import pathlib
import pty
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import tty

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "sim" / "apps"))
from control_client import ControlClient  # noqa: E402

SETUP_S, JOB_S = 300, 240
GEAR = 90.0
SCANNED = ("reconstructing", "done")
LAMPS = {"lamp_red": "red lamp", "lamp_amber": "amber lamp", "lamp_green": "green lamp",
         "start_lamp": "lamp in the Start button", "flip_request": "flip lamp", "busy": "busy, to an automation",
         "pass": "pass", "fail": "fail"}
LAST_OUTPUT = "the projector's plain light"
KINDS = {
    "drive_and_gpio": {"rig": [], "ports": ["turntable"], "panel": "gpio", "driver": "modbus"},
    "controller_and_module": {"rig": ["--drive", "grbl", "--panel", "modbus-io"], "ports": ["turntable", "panel"],
                              "panel": "modbus-io", "driver": "grbl"},
}
# Nothing else may be asked: it could be found out.
QUESTIONS = ("How many turns", "Which camera is on the left", "Is everyone clear", "which way", "Put a mark", "By how many degrees")
QUESTIONS_OF_MODULE = ("Where are buttons", "then press Enter", "Is there a button", "Is there a guard", "May all of them",
                       "What does it switch")


class Person:
    """Does and replies what the lines of the conversation ask for; remembers every question."""

    def __init__(self, rig, reply):
        self.rig, self.reply, self.questions = rig, reply, []
        self.offered = []

    def hold(self, button, seconds=0.5):
        self.rig.request(press=button)
        time.sleep(seconds)
        self.rig.request(release=button)

    def answer(self, question, text):
        self.questions.append(question)
        self.reply(text)

    def read(self, line):
        """The numbered options of a question follow it: the last one tells that they are complete."""
        option = re.fullmatch(r"  (\d+)  (.*)", line)
        if option:
            self.offered.append(option.group(2))
            return self.choose()
        self.asked = line
        self.offered = []
        for pattern, action in (
                ("How many turns", lambda: self.answer(line, f"{GEAR}")),
                ("Put a mark", self.put_mark),
                ("then press Enter", lambda: self.answer(line, "")),
                ("Is there a button Stop", lambda: self.answer(line, "y")),
                ("Is there a guard", lambda: self.answer(line, "y")),
                ("May all of them", lambda: self.answer(line, "y")),
                ("Is everyone clear", lambda: self.answer(line, "y")),
                ("which way", self.tell_direction),
                ("By how many degrees", self.tell_mark),
                ("Press Start and hold it", lambda: self.hold("start")),
                ("Press Reset and hold it", lambda: self.hold("reset")),
                (r"Press Stop \(not the", lambda: self.hold("stop")),
                ("Press the emergency stop", lambda: self.rig.request(press="estop")),
                ("Release the emergency stop", lambda: self.rig.request(release="estop")),
                ("Open the guard", lambda: self.rig.request(release="guard")),
                ("Close the guard\\.$", lambda: self.rig.request(press="guard"))):
            if re.search(pattern, line):
                return action()

    def tell_direction(self):
        angle = self.rig.request(get="truth")["angle_deg"]
        self.answer(self.asked, "ccw" if angle % 360 < 180 else "cw")

    def put_mark(self):
        self.marked_deg = self.rig.request(get="truth")["angle_deg"]
        self.answer(self.asked, "")

    def tell_mark(self):
        angle = self.rig.request(get="truth")["angle_deg"]
        self.answer(self.asked, f"{(angle - self.marked_deg + 180) % 360 - 180:.0f}")

    def choose(self):
        if self.asked.startswith("Which camera is on the left") and len(self.offered) == 2:
            self.answer(self.asked, str(1 + next(i for i, name in enumerate(self.offered) if "SIM-L" in name)))
        elif self.asked.startswith("Where are buttons") and len(self.offered) == 2:
            self.answer(self.asked, "2")
        elif "What does it switch" in self.asked and self.offered[-1] == LAST_OUTPUT:
            lit = [name for name, on in self.rig.request(get="outputs").items() if on]
            self.answer(self.asked, str(1 + self.offered.index(LAMPS[lit[0]] if lit else "nothing")))


def converse(command, rig, limit_s=SETUP_S, **options):
    """Runs a command at a terminal, with a person who does what it asks for. Returns (exit code, text, questions)."""
    here, there = pty.openpty()
    tty.setraw(there)
    process = subprocess.Popen([str(word) for word in command], stdin=there, stdout=there, stderr=there, **options)
    os.close(there)
    timer = threading.Timer(limit_s, process.kill)
    timer.start()
    person, text = Person(rig, lambda reply: os.write(here, f"{reply}\n".encode())), ""
    with open(here, encoding="utf-8", closefd=False) as lines, contextlib.suppress(OSError):  # no one has it open
        for line in lines:
            text += line
            person.read(line.rstrip("\n"))
    code = process.wait()
    timer.cancel()
    os.close(here)
    return code, text, person.questions


def set_up(binaries, kind, rig_folder, new, rig):
    command = [binaries / "scanrig", "setup", "--out", new / "rig.toml", "--state", new, "--http-port", "0",
               "--gpio-socket", rig_folder / "gpio.sock"]
    for port in kind["ports"]:
        command += ["--port", rig_folder / port]
    return converse(command, rig)


def scan(binaries, new, rig):
    """Scans a job with the written file; its state."""
    daemon = subprocess.Popen([binaries / "scanrigd", "--config", new / "rig.toml"], stdout=subprocess.DEVNULL,
                              stderr=open(new / "scanrigd.log", "w"))
    operator = threading.Thread(target=rig.operate, daemon=True)
    operator.start()
    end, state = time.monotonic() + JOB_S, "none"
    try:
        while time.monotonic() < end and state not in SCANNED and state != "failed":
            time.sleep(0.5)
            told = subprocess.run([binaries / "scanrig", "jobs", "--json", "--socket", new / "api.sock"],
                                  capture_output=True, text=True)
            jobs = json.loads(told.stdout).get("jobs", []) if told.returncode == 0 else []
            state = jobs[0]["state"] if jobs else state
        return state
    finally:
        daemon.terminate()
        daemon.wait(timeout=60)


def check(binaries, name, folder):
    kind, new = KINDS[name], folder / "new"
    sim = subprocess.Popen([binaries / "scanrig-sim", "rig", "--dir", folder / "rig", "--cameras", "gige", "--scale", "0.25",
                            "--voxel-mm", "1", *kind["rig"]], stdout=subprocess.PIPE, text=True)
    try:
        if "ready" not in sim.stdout.readline():
            return "the simulated rig did not start"
        rig = ControlClient(folder / "rig" / "control.sock")
        new.mkdir()
        (new / "drives").symlink_to((folder / "rig" / "drives").resolve())
        shutil.copy(folder / "rig" / "calibration.json", new)
        code, text, questions = set_up(binaries, kind, folder / "rig", new, rig)
        print(text)
        if code != 0:
            return f"setup ended with {code}"
        allowed = QUESTIONS + (QUESTIONS_OF_MODULE if kind["panel"] == "modbus-io" else ())
        needless = [one for one in questions if not any(known in one for known in allowed)]
        if needless:
            return f"asked what could be found out: {needless}"
        written = (new / "rig.toml").read_text()
        print(written)
        for wanted in (f'driver = "{kind["driver"]}"', f'driver = "{kind["panel"]}"', 'left = { serial = "SIM-L"'):
            if wanted not in written:
                return f"rig.toml lacks {wanted}"
        again = subprocess.run([binaries / "scanrig", "setup", "--out", new / "rig.toml", "--interactive"],
                               stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if again.returncode != 6 or (new / "rig.toml").read_text() != written:
            return f"a file that was there was not left alone: {again.returncode}, {again.stderr}"
        state = scan(binaries, new, rig)
        return None if state in SCANNED else f"the job is {state}: {(new / 'scanrigd.log').read_text()[-2000:]}"
    finally:
        sim.terminate()
        sim.wait(timeout=10)


def main():
    binaries, name = pathlib.Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory(prefix="scanrig-setup-") as folder:
        wrong = check(binaries, name, pathlib.Path(folder))
    if wrong:
        print(f"{name}: {wrong}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
