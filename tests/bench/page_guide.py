"""docs/guide/install.md followed as it is written: from a bare machine to the model of a part on the simulated wired rig.

The commands are those of the guides, in their order. What is prose there a person does: PERSON, through the rig's control
socket. What a machine without systemd, GPIO chips and board cannot do is played, and said in the line.
"""
import json
import pathlib
import re
import shutil
import sys
import threading
import time

import bare_machine
import page_package
from guide_machine import DEBIAN, Machine

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / folder) for folder in ("tests/guides", "tests/system/setup", "sim/apps")]
import commands as guides  # noqa: E402
from control_client import ControlClient  # noqa: E402
from run_setup import converse  # noqa: E402
import stepped_block  # noqa: E402

LIMIT_MIN = 15
APT_S, RIG_S, RENDER_S, TALK_S, CALIBRATE_S, SCAN_S, MODEL_S = 300, 600, 60, 240, 600, 300, 600
SCALE = 0.5  # smaller images do not show a board's markers
SMALL = {"views": 4, "voxel_mm": 1}  # instead of 8 views of a pose, and a voxel of 0.25 mm
GPIO = "/rig/gpio.sock"
DEMO, DEMO_SOCKET = "/run/scanrig-sim/api.sock", {"SCANRIG_SOCKET": "/run/scanrig-sim/api.sock"}
UNCALIBRATED = {"SCANRIG_SOCKET": "/uncalibrated/api.sock"}
PAGE = "import sys, urllib.request; print(len(urllib.request.urlopen(sys.argv[1]).read()))"


class Step:
    """A command in a fence, a file in a fence, or a sentence of prose."""

    def __init__(self, line, section, kind, text):
        self.line, self.section, self.kind, self.text = line, section, kind, text


def headings(document):
    found = [(0, "")]
    for number, line in enumerate(document.read_text().splitlines(), 1):
        if heading := re.match(r"#+ (.+)", line):
            found.append((number, heading[1]))
    return found


def steps_of(name, sentences):
    """Steps of a guide in their order; raises LookupError for a sentence of `sentences` that the guide does not have."""
    document = ROOT / "docs" / "guide" / name
    above = headings(document)

    def section(number):
        return [heading for at, heading in above if at <= number][-1]

    lines = document.read_text().splitlines()
    steps = [Step(int(command.where.split(":")[1]), "", "command", command.text) for command in guides.commands(ROOT, ())
             if command.where.startswith(f"docs/guide/{name}:") and not command.in_text]
    for sentence in sentences:
        where = [number for number, line in enumerate(lines, 1) if sentence in line]
        if not where:
            raise LookupError(f"{name} does not say: {sentence}")
        steps.append(Step(where[0], "", "prose", sentence))
    for step in steps:
        step.section = section(step.line)
    return sorted(steps, key=lambda step: (step.line, step.kind == "command"))


def actions(name, do, leave=()):
    """(step, function) of a guide, in its order. `do` has what is not simply run, by the command, by "SECTION: COMMAND" or by
    "...SENTENCE". Sections of `leave` have other tests. Raises LookupError for what `do` has and the guide does not."""
    taken, unused = [], set(do)
    for step in steps_of(name, [text[3:] for text in do if text.startswith("...")]):
        if step.section in leave:
            continue
        text = f"...{step.text}" if step.kind == "prose" else step.text
        known = next((key for key in (f"{step.section}: {text}", text) if key in do), None)
        unused.discard(known)
        taken.append((step, do[known] if known else Reader.run))
    if unused:
        raise LookupError(f"{name} does not have: {', '.join(sorted(unused))}")
    return taken


class Reader:
    """A new user with the guides, at a machine and a rig."""

    def __init__(self, bench, machine):
        self.bench, self.machine = bench, machine
        self.rig = self.job = None

    def follow(self, name, do, leave=()):
        for step, action in actions(name, do, leave):
            self.take(step, action)

    def take(self, step, action):
        begun = time.monotonic()
        if isinstance(action, str):
            self.bench.note(f"guide: {step.text}: not run: {action}")
            return
        ok, seen = action(self, step)
        seconds = time.monotonic() - begun
        what = f"guide, {step.section}: {step.text}".replace("|", "/")
        self.bench.line(what, "works", f"{seen.strip()[-200:].replace('|', '/')} ({seconds:.0f} s)", ok)
        if not ok:
            raise RuntimeError(f"a new user is stuck here: {what}")

    def run(self, step, **environment):
        code, said = self.machine.run(step.text if not self.job else re.sub(r"\bID\b", self.job, step.text), APT_S,
                                      **environment)
        return code == 0, last_line(said) if code == 0 else f"exit code {code}: {said}"

    def talk(self, step, more=""):
        code, said, _ = converse(self.machine.inside(step.text + more), self.rig, TALK_S)
        return code, said

    def tap(self, button, lamps, limit_s):
        self.rig.tap(button)
        return self.sees(lamps, limit_s)

    def sees(self, lamps, limit_s):
        """Waits for lamps: a name, or `!name` for one that is off."""
        lit = {}

        def as_wanted():
            lit.update(self.rig.request(get="outputs"))
            return all(lit[lamp.lstrip("!")] != lamp.startswith("!") for lamp in lamps)

        ok = self.machine.wait_for(as_wanted, limit_s, 0.05)
        seen = "lit: " + (", ".join(name for name, on in lit.items() if on) or "nothing")
        return ok, seen if ok else f"{seen}; {self.machine.run('scanrig status')[1]}"


def last_line(said):
    return ([line for line in said.splitlines() if line.strip()] or ["nothing printed"])[-1]


def say_yes(reader, step):
    """apt asks; the person says yes."""
    (reader.machine.root / "etc/apt/apt.conf.d/yes").write_text('APT::Get::Assume-Yes "true";\n')
    return reader.run(step)


def show_demo(reader, step):
    reader.machine.own_network()
    code, said = reader.machine.run(step.text)
    address = re.search(r"http://127.0.0.1:8081/#code=\w+", said)
    return code == 0 and bool(address), "the page's address, with a code" if address else said


def start_demo(reader, _):
    """START of the page, by the command line: the page itself is tried in a browser."""
    reader.machine.wait_for(lambda: "Ready" in reader.machine.run("scanrig status", **DEMO_SOCKET)[1], 60)
    code, said = reader.machine.run("scanrig start", **DEMO_SOCKET)
    begun = reader.machine.wait_for(lambda: "job: " in reader.machine.run("scanrig status", **DEMO_SOCKET)[1], 30)
    return code == 0 and begun, said or "the job begins"


def stop_demo(reader, _):
    code, said = reader.machine.run("systemctl stop scanrigd-sim")
    return code == 0 and not (reader.machine.root / DEMO[1:]).exists(), said or "stopped"


def connect_rig(reader, _):
    """Drive and panel as Linux shows them: an adapter with a serial number, lines of the groups that udev gives."""
    machine = reader.machine
    log = open(machine.root / "rig.log", "w")
    machine.start(f"exec scanrig-sim rig --dir /rig --cameras gige --scale {SCALE} --views {SMALL['views']} --start-deg 10",
                  stdout=log, stderr=log)
    ready = machine.wait_for(lambda: "rig ready" in (machine.root / "rig.log").read_text(), RIG_S)
    plugged, said = machine.run(
        "port=$(readlink -f /rig/turntable) && chgrp dialout $port && chmod 660 $port && mkdir -p /dev/serial/by-id && "
        "ln -s $port /dev/serial/by-id/usb-FTDI_FT232R_USB_UART_SIM0001-if00-port0 && "
        f"chgrp gpio {GPIO} && chmod 660 {GPIO}")
    if ready and plugged == 0:
        reader.rig = ControlClient(machine.root / "rig" / "control.sock")
        reader.rig.request(press="guard")
    return ready and plugged == 0, said or "the simulated rig: drive, panel, lights, two GigE cameras"


def list_cameras(reader, _):
    code, said = reader.machine.run("scanrig camera list")
    return code == 0 and "SIM-L" in said and "SIM-R" in said, " ".join(said.split())


def set_up(reader, step):
    """Lines of a GPIO chip cannot be made here: they are behind a socket, which one more option names. Afterwards a person
    makes the scan a small one."""
    code, said = reader.talk(step, f" --gpio-socket {GPIO}")
    written = reader.machine.root / "etc/scanrig/rig.toml"
    if code == 0:
        text = written.read_text()
        for key, value in SMALL.items():
            text = re.sub(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
        written.write_text(text)
    return code == 0, said if code else f"rig.toml written, the doctor finds nothing more; then edited: {SMALL}"


def set_aside(reader, step):
    """The other way to a rig.toml: that of setup is away meanwhile."""
    reader.machine.run("mv /etc/scanrig/rig.toml /etc/scanrig/of-setup.toml")
    return reader.run(step)


def check_by_hand(reader, step):
    held = reader.run(step)
    reader.machine.run("mv /etc/scanrig/of-setup.toml /etc/scanrig/rig.toml")
    return held


def render(reader):
    """Views of where the table is, which the simulated cameras render when they are exposed for the first time."""
    for light in ("pattern", "plain"):
        grab = f"scanrig camera grab --light {light} --out /tmp/{light}"
        reader.machine.wait_for(lambda: reader.machine.run(grab)[0] == 0, RENDER_S)


def examine(reader, step):
    """There is no calibration yet: that is the finding."""
    render(reader)
    code, said = reader.talk(step)
    found = re.findall(r"^  (\w+): ", said.partition(" finding(s)\n")[2], re.MULTILINE)
    return found == ["no_calibration"], f"exit code {code}, findings: {', '.join(found) or said}"


def read_status(reader, step):
    """The command again, until the status asks for something that a person can do."""
    said = ["", ""]

    def asks():
        said[:] = reader.machine.run(step.text)
        return "Press Reset" in said[1]

    return reader.machine.wait_for(asks, 30, 1), last_line(said[1])


def press_reset(reader, _):
    """The lamp in Start stays dark: there is no calibration."""
    ok, seen = reader.tap("reset", ["lamp_green", "!busy", "!start_lamp"], 60)
    return ok, f"{seen}; {last_line(reader.machine.run('scanrig status')[1])}"


def calibrate(reader, step):
    """The simulated wired cameras see no board: the same rig in one process has one, and an operator who places it."""
    machine = reader.machine
    log = open(machine.root / "uncalibrated.log", "w")
    machine.start("mkdir /uncalibrated && exec scanrigd-sim --socket /uncalibrated/api.sock --jobs /uncalibrated/jobs "
                  f"--own-calibration --operator helper --clock virtual --scale {SCALE}", stdout=log, stderr=log)
    machine.wait_for(lambda: "Ready" in machine.run("scanrig status", **UNCALIBRATED)[1], 60)
    code, said = machine.run(step.text, CALIBRATE_S, **UNCALIBRATED)
    grade = re.search(r"Calibration of grade \w", said)
    return code == 0 and bool(grade), grade[0] if grade else said


def characterise(reader, step):
    """With the images that a person with paper and caps takes: the simulated wired cameras see neither."""
    code, said = reader.machine.run("scanrig-sim shoot-flats --profile workshop --out /tmp/flats", MODEL_S)
    if code == 0:
        code, said = reader.machine.run(f"{step.text} --from /tmp/flats --out /tmp/characterisation.json", MODEL_S)
    return code == 0, said


def accept(reader, step):
    code, said = reader.machine.run(step.text, **UNCALIBRATED)
    made = reader.machine.root / "uncalibrated/jobs/calibration.json"
    if code == 0:
        shutil.copy(made, reader.machine.root / "var/lib/scanrig/calibration.json")
    taken = reader.machine.wait_for(lambda: "calibration" not in reader.machine.run("scanrig status")[1], 30, 1)
    return code == 0 and taken, said


def see_ready(reader, _):
    return reader.sees(["lamp_green", "start_lamp"], 60)


def press_start(reader, _):
    return reader.tap("start", ["busy"], 30)


def turn_over(reader, _):
    ok, seen = reader.sees(["flip_request", "start_lamp"], SCAN_S)
    if ok:
        reader.rig.request(turn_over=True)
    return ok, seen


def continue_scan(reader, _):
    return reader.tap("start", ["!flip_request"], 30)


def see_done(reader, _):
    ok, seen = reader.sees(["lamp_green", "!busy"], SCAN_S)
    jobs = json.loads(reader.machine.run("scanrig jobs --json")[1])["jobs"]
    reader.job = jobs[0]["id"]
    return ok, f"{seen}; job {jobs[0]['state']}"


def export_model(reader, step):
    state = {}

    def ended():
        state.update(json.loads(reader.machine.run(f"scanrig jobs {reader.job} --json")[1]))
        return state["state"] in ("done", "failed")

    reader.machine.wait_for(ended, MODEL_S, 2)
    code, said = reader.machine.run(step.text.replace("ID", reader.job))
    return state["state"] == "done" and code == 0, f"job {state['state']}: {said}"


def add_reference(reader, step):
    """A design of the part; any will do that the service can read."""
    stepped_block.write(reader.machine.root / "root" / "bracket.obj")
    code, said = reader.machine.run(step.text.replace(".stl", ".obj"))
    return code == 0, said


INSTALL = {
    "apt install ./scanrig_*.deb": say_yes,
    "scanrig-demo": show_demo,
    "...Press START": start_demo,
    "...End: `systemctl stop scanrigd-sim`": stop_demo,
    "...Wire drive, e-stop, panel, lights and cameras": connect_rig,
    "...`scanrig camera list` prints both serial numbers": list_cameras,
    "scanrig setup": set_up,
    "install -m 0644 /usr/share/scanrig/rigs/example.toml /etc/scanrig/rig.toml": set_aside,
    "editor /etc/scanrig/rig.toml": "the example is valid as it is",
    "scanrig check-config": check_by_hand,
    "scanrig doctor --allow-motion": examine,
    "scanrig status": read_status,
    "...Press Reset at the panel": press_reset,
}
CALIBRATE = {
    "At the rig: scanrig calibrate --rig": calibrate,
    "scanrig calibrate --accept": accept,
    "scanrig camera characterise": characterise,
}
OPERATE = {
    "...The green lamp and the lamp in Start are lit": see_ready,
    "...2. Press Start": press_start,
    "...Amber and the Start lamp light again": turn_over,
    "...5. Press Start": continue_scan,
    "...Green again: all views are taken": see_done,
    "scanrig export ID": export_model,
    "scanrig reference add bracket.stl": add_reference,
}
# In their order: the guide, what a person or this file does there, sections that have other tests.
GUIDES = (("install.md", INSTALL, ()), ("calibrate.md", CALIBRATE, ("When something goes wrong", "Does it still hold?")),
          ("operate.md", OPERATE,
           ("The queue", "When pose 2 fits in several ways", "Another pose for a finished scan")))


def walk(bench, packages):
    with bare_machine.bare_machine("bookworm", DEBIAN) as root:
        for package in packages:
            shutil.copy(package, root / "root")
        with Machine(root) as machine:
            machine.run("echo force-unsafe-io >/etc/dpkg/dpkg.cfg.d/test; apt-get update -qq")
            reader = Reader(bench, machine)
            for guide in GUIDES:
                reader.follow(*guide)


def measure(bench, scratch):
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line("a new user with the guides", "a model", reason, None)
        return
    if packages := page_package.build_here(bench):
        begun = time.monotonic()
        walk(bench, packages)
        bench.at_most("guide: from a bare machine to a model", LIMIT_MIN, (time.monotonic() - begun) / 60, "min", digits=1)
