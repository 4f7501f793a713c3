"""run_commands.py ROOT BIN: every command of README.md and the guides works; exits 1 when one does not.

A command is in one class. STEPS run, in this order, at a simulated rig: the service over simulated wires in a folder of
its own, with the recipe of the night from the guide. PARSED have verbs and options that the program has; NOT_RUN are
programs of others. Every command of our programs is parsed, also those that run.
"""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from commands import PROGRAMS, Manual, blocks, commands, lone_options

UNATTENDED = "docs/guide/unattended.md"
STEP_LIMIT_S = 25
BUSY = 6
INTERRUPTED = -signal.SIGINT
CUBE = [(x, y, z) for x in (-20, 20) for y in (-20, 20) for z in (-20, 20)]
SIDES = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")

# What begins so is only parsed: the reason.
PARSED = {
    "./dev": "builds, installs packages or measures for minutes",
    "scanrig camera": "reads the cameras of this machine; the simulated ones have no driver",
    "scanrig calibrate DIR": "needs a series of images: tests/system/daemon/calibrate_test.cpp",
    "scanrig calibrate JOBS/ID": "likewise",
    "scanrig reconstruct": "needs a whole scan: tests/system/daemon/exit_codes_test.cpp",
    "scanrig convert": "likewise",
    "scanrig farm": "needs a cluster: tests/component/daemon/farm_test.cpp",
    "scanrig acceptance": "needs a scanned artefact: ./dev bench real-rig",
    "scanrig doctor --allow-motion": "turns the table for 15 s: ./dev bench motion",
    "scanrig setup": "needs a person at the rig: tests/system/setup",
    "scanrig projector": "needs a LightCrafter: tests/component/lightcrafter",
    "scanrig token add NAME": "as the step with a name",
    "scanrig reprocess ID": "needs a whole scan",
    "scanrig export ID": "needs a model",
}
NOT_RUN = {
    "cmake": "builds and installs the whole tree",
    "systemd-sysusers": "makes users of this machine",
    "systemd-tmpfiles": "makes folders of this machine",
    "sysctl": "sets this machine's kernel",
    "udevadm": "sets this machine's devices",
    "systemctl": "this machine's services; ./dev hil runs them",
    "journalctl": "reads this machine's log",
    "install": "writes below /etc",
    "editor": "waits for a person",
    "apt": "installs on this machine: tests/package",
    "scanrig-demo": "starts a unit of this machine",
}


def facets(side):
    """Two triangles of a text STL file."""
    a, b, c, d = ("vertex {} {} {}\n".format(*CUBE[int(number) - 1]) for number in side.split())
    return "".join(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n" for corners in (a + b + c, a + c + d))


class Step:
    """A command of a guide with its exit code. `more` is added to it here; `endless` is interrupted after its first output;
    `setup` steps are in no guide."""

    def __init__(self, text, code=0, more=(), endless=False, setup=False):
        self.text, self.code, self.more, self.endless, self.setup = text, code, more, endless, setup


CONFIG = ("--config", "rig.toml")
WITH_SERVICE = (
    Step("scanrig status"),
    Step("scanrig health"),
    Step("scanrig status --watch", endless=True),
    Step("scanrig open"),
    Step("scanrig open --role engineer"),
    Step("scanrig open --kiosk", more=("--browser", "true")),
    Step("scanrig token add tablet --role operator", more=CONFIG),
    Step("scanrig token list", more=CONFIG),
    Step("scanrig token revoke tablet", more=CONFIG),
    Step("scanrig reference add bracket.stl", more=CONFIG),
    Step("scanrig reference list", more=CONFIG),
    Step("scanrig reference remove bracket", more=CONFIG),
    Step("scanrig maintenance on"),
    Step("scanrig maintenance home"),
    Step("scanrig maintenance jog --to 90 --speed 10"),
    Step("scanrig stop", setup=True),  # it would take 9 s
    Step("scanrig maintenance pulse"),
    Step("scanrig maintenance lamp_test"),
    Step("scanrig maintenance io"),
    Step("scanrig maintenance off"),
    Step("scanrig reset", setup=True),
    Step("scanrig calibrate --rig", code=INTERRUPTED, endless=True),
    Step("scanrig calibrate --abort"),
    Step("scanrig calibrate --check", code=INTERRUPTED, endless=True),
    Step("scanrig calibrate --abort", setup=True),
    Step("scanrig calibrate --accept", code=6),  # none is solved
    Step("scanrig queue --part 4711 --repeat 5"),  # prints the ID of the steps after it
    Step("scanrig queue --recipe night --part LOT-4711 --repeat 40"),
    Step("scanrig jobs"),
    Step("scanrig jobs ID"),
    Step("scanrig jobs ID choose N", code=6),  # there is nothing to choose
    Step("scanrig jobs ID add-pose", code=6),  # it is queued
    Step("scanrig first ID"),
    Step("scanrig start", setup=True),
    Step("scanrig stop"),
    Step("scanrig files ID"),
    Step("scanrig bundle ID"),
    Step("scanrig resume ID"),
    Step("scanrig cancel ID"),
    Step("scanrig reload"),
)
WITHOUT_SERVICE = (
    Step("scanrig turntable status", more=CONFIG),
    Step("scanrig panel watch", more=CONFIG, endless=True),
    Step("scanrig doctor", more=CONFIG),
    Step("scanrigd --make-safe", more=CONFIG),
    Step("scanrig check-config", more=("example.toml",)),
    Step("scanrig check-config FILE"),
    Step("scanrigd-sim --rig-seed 5 --operator helper", endless=True,
         more=("--socket", "drawn.sock", "--jobs", "drawn", "--object", "cube.obj")),
)


def wait_for(what, condition):
    limit = time.monotonic() + STEP_LIMIT_S
    while not condition():
        if time.monotonic() > limit:
            raise RuntimeError(f"{what}: not in {STEP_LIMIT_S} s")
        time.sleep(0.05)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class Bench:
    """A simulated rig in a folder of its own. Sockets have short paths, so the folder is in the system's for such."""

    def __init__(self, root, binaries):
        self.root, self.binaries = root, binaries
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="guides"))
        self.environment = {**os.environ, "SCANRIG_SOCKET": str(self.folder / "api.sock")}
        self.processes = []
        self.id = "ID"

    def start(self, *words):
        log = open(self.folder / f"{words[0]}.log", "w")
        return self.begin([self.binaries / words[0], *words[1:]], log)

    def begin(self, command, log):
        """A process that ends with this one."""
        self.processes.append(subprocess.Popen(["setpriv", "--pdeathsig", "TERM", *command], cwd=self.folder, stdout=log,
                                               stderr=log, env=self.environment))
        return self.processes[-1]

    def start_rig(self):
        """The service at its wires, with the recipe of the guide."""
        (self.folder / "cube.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in CUBE) +
                                              "".join(f"f {side}\n" for side in SIDES))
        (self.folder / "bracket.stl").write_text("solid bracket\n" + "".join(map(facets, SIDES)) + "endsolid\n")
        self.start("scanrig-sim", "rig", "--dir", str(self.folder), "--start-deg", "10", "--scale", "0.1", "--no-noise",
                   "--speed-deg-s", "180", "--acceleration-deg-s2", "720", "--object", str(self.folder / "cube.obj"))
        file = self.folder / "rig.toml"
        wait_for("the simulated rig", lambda: file.exists() and (self.folder / "gpio.sock").exists())
        text = file.read_text().replace("remote_start = false", "remote_start = true")
        recipe = "\n".join(blocks(self.root, UNATTENDED, "toml"))
        file.write_text(f'{text}\ntokens = "tokens.json"\nhttp_port = {free_port()}\n{recipe}')
        shutil.copy(self.root / "config" / "rigs" / "example.toml", self.folder)
        self.service = self.start("scanrigd-sim", *CONFIG, "--object", "cube.obj", "--scale", "0.1")
        wait_for("the service", lambda: "Halted" in self.status())

    def status(self):
        return subprocess.run([self.binaries / "scanrig", "status"], capture_output=True, text=True,
                              env=self.environment).stdout

    def run(self, step):
        """What is wrong with a step, or None."""
        values = {"ID": self.id, "FILE": "example.toml", "N": "1"}
        program, *words = [values.get(word, word) for word in step.text.split()]
        command = [self.binaries / program, *words, *step.more]
        limit = time.monotonic() + STEP_LIMIT_S
        while True:
            done = self.interrupted(command) if step.endless else subprocess.run(
                command, cwd=self.folder, capture_output=True, text=True, env=self.environment, timeout=STEP_LIMIT_S)
            # What the step before began goes on.
            if done.returncode != BUSY or step.code == BUSY or time.monotonic() > limit:
                break
            time.sleep(0.2)
        if step.text.startswith("scanrig queue") and self.id == "ID":
            self.id = done.stdout.strip()
        return None if done.returncode == step.code else f"exit code {done.returncode}, not {step.code}: {done.stderr}"

    def interrupted(self, command):
        """Runs a command that does not end by itself."""
        with open(self.folder / "endless.log", "w+") as log:
            process = self.begin(command, log)
            ready = self.folder / "drawn.sock"
            wait_for(command[0], lambda: os.fstat(log.fileno()).st_size or ready.exists() or process.poll() is not None)
            process.send_signal(signal.SIGINT)
            code = process.wait(STEP_LIMIT_S)
            log.seek(0)
            return subprocess.CompletedProcess(command, code, "", log.read())

    def stop(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in self.processes:
            try:
                process.wait(STEP_LIMIT_S)
            except subprocess.TimeoutExpired:
                process.kill()

    def stop_service(self):
        self.service.terminate()
        self.service.wait(STEP_LIMIT_S)


def is_parsed_only(text):
    return any((text + " ").startswith(begin + " ") for begin in PARSED)


def classes(written, manual):
    """Problems of the commands as they are written: parsed, and in one class."""
    steps = {step.text for step in WITH_SERVICE + WITHOUT_SERVICE if not step.setup}
    for command in written:
        if command.program in PROGRAMS:
            problem = manual.problem(command)
            if problem:
                yield f"{command.where}: `{command.text}`: {problem}"
            elif not manual.names_a_verb(command) and command.text not in steps and not is_parsed_only(command.text):
                yield f"{command.where}: `{command.text}`: in no class of tests/guides/run_commands.py"
        elif command.program not in NOT_RUN:
            yield f"{command.where}: `{command.text}`: in no class of tests/guides/run_commands.py"
    for where, option in lone_options(manual.root):
        if not manual.has_option(option):
            yield f"{where}: no program has the option {option}"
    texts = [command.text for command in written]
    for text in sorted(steps - set(texts)):
        yield f"tests/guides/run_commands.py: `{text}`: in no guide"
    for begin in (*PARSED, *NOT_RUN):
        if not any((text + " ").startswith(begin + " ") for text in texts):
            yield f"tests/guides/run_commands.py: `{begin}`: in no guide"


def steps_run(bench):
    """Problems of the steps."""
    bench.start_rig()
    for step in WITH_SERVICE + WITHOUT_SERVICE:
        if step is WITHOUT_SERVICE[0]:
            bench.stop_service()
        begin = time.monotonic()
        problem = bench.run(step)
        print(f"{'NO' if problem else 'ok'}  {step.text} ({time.monotonic() - begin:.1f} s)", flush=True)
        if problem:
            yield f"{step.text}: {problem}"


def main():
    root, binaries = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    written = list(commands(root, NOT_RUN))
    problems = list(classes(written, Manual(root, binaries)))
    bench = Bench(root, binaries)
    try:
        problems += steps_run(bench)
    except (RuntimeError, subprocess.TimeoutExpired) as failed:
        problems.append(str(failed))
    finally:
        bench.stop()
    if problems:
        print(f"logs: {bench.folder}")
    else:
        shutil.rmtree(bench.folder)
    for problem in problems:
        print(problem)
    print(f"{len(written)} commands of the guides, {len(WITH_SERVICE + WITHOUT_SERVICE)} steps, {len(problems)} problems")
    return 1 if problems or not written else 0


if __name__ == "__main__":
    sys.exit(main())
