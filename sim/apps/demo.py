#!/usr/bin/env python3
"""./dev demo: one object through the simulated rig, from Start to the model and its scores against the truth."""
import argparse
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

import demo_calibration
from control_client import ControlClient

START_LIMIT_S = 60
RENDER_LIMIT_S = 900
VOXEL_MM = 0.25
INSIDE = "SCANRIG_DEMO_NETWORK"  # set inside the network namespace
JOB_LIMIT_S = 3600
PAGE_PORT = 8080
SMALLEST_SCALE = 0.5  # smaller images do not show a board's markers


def arguments():
    parser = argparse.ArgumentParser(prog="./dev demo", description=__doc__)
    parser.add_argument("--object", type=pathlib.Path, help="OBJ, PLY or GLB to scan (default: the built-in figurine)")
    parser.add_argument("--height-mm", type=float, default=100.0, help="the object is scaled to this height")
    parser.add_argument("--seed", type=int, default=1, help="placements, noise, table errors")
    parser.add_argument("--views", type=int, default=8, help="views a pose")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/demo"), help="folder for the scan")
    parser.add_argument("--keep", action="store_true", help="leave the daemon running")
    parser.add_argument("--page", action="store_true",
                        help="show the web page; the daemon keeps running afterwards, until Ctrl-C")
    parser.add_argument("--same-rest", action="store_true", help="the operator does not turn the object over")
    parser.add_argument("--scale", type=float, default=1.0, help="of the images: 0.25 gives 320x240")
    parser.add_argument("--no-noise", action="store_true", help="sensors without noise")
    parser.add_argument("--calibration", choices=("own", "true"), default="own",
                        help="own: the rig calibrates itself once; true: the rig knows its exact geometry")
    parser.add_argument("--profile", choices=("workshop", "laboratory"), default="workshop",
                        help="workshop: light, lenses, materials and mechanics as they are; laboratory: ideal ones")
    parser.add_argument("--wire", action="store_true",
                        help="the shipped daemon over wires: Modbus drive, GPIO lines, two GigE cameras")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.page and options.wire:
        parser.error("--page shows the simulated rig without wires: leave --wire out")
    options.keep = options.keep and not options.page  # Ctrl-C ends the page
    return options


def report_error(sentence, code):
    print(f"demo: {sentence}", file=sys.stderr)
    return code


def make_room(folder):
    """An empty folder: an earlier demo's is replaced, anything else is left alone. Returns an error for any other content."""
    if folder.exists() and any(folder.iterdir()):
        if not (folder / "demo.log").is_file():
            return f"{folder} is not empty and not an earlier demo; name another folder with --out"
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return None


def free_port(wanted):
    """That one, or another where a program has it."""
    for port in (wanted, 0):
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                one.bind(("127.0.0.1", port))
            except OSError:
                continue
            return one.getsockname()[1]
    return wanted


def scene(options):
    """Options for the object on the table, common to both simulators."""
    words = ["--seed", options.seed, "--views", options.views, "--height-mm", options.height_mm,
             "--scale", options.scale, "--profile", options.profile]
    if options.object:
        words += ["--object", options.object]
    words += [flag for flag, on in (("--same-rest", options.same_rest), ("--no-noise", options.no_noise)) if on]
    return words


class SimulatedStation:
    """One program: daemon, rig and operator."""

    def __init__(self, folder):
        self.jobs = folder / "jobs"
        self.socket = folder / "api.sock"
        self.processes = []

    def start(self, options, log, calibration=None, extra=("--true-calibration",)):
        """Returns the process that is the daemon."""
        if calibration:
            self.jobs.mkdir(parents=True)
            shutil.copy(calibration, self.jobs)
            extra = ["--own-calibration"]
        if options.page:
            extra = ["--http-port", free_port(PAGE_PORT), "--background-cameras", *extra]
        command = [options.bin / "scanrigd-sim", "--socket", self.socket, "--jobs", self.jobs, *scene(options), *extra]
        self.processes.append(run(command, log))
        return self.processes[0]

    def finish(self, job):
        pass


class WireStation:
    """The shipped daemon, and at the other ends of its wires the simulated rig, whose panel this program operates."""

    def __init__(self, folder):
        self.rig = folder / "rig"
        self.jobs = self.rig / "jobs"
        self.socket = self.rig / "api.sock"
        self.processes = []  # in the order in which they must end

    def start(self, options, log, calibration=None):
        """Returns the process that is the daemon; the rig where it ended instead of becoming ready."""
        print("Rendering the views of the cameras", flush=True)
        rig = run([options.bin / "scanrig-sim", "rig", "--dir", self.rig, "--cameras", "gige", "--voxel-mm", VOXEL_MM,
                   *scene(options)], log, stdout=subprocess.PIPE, text=True)
        self.processes.append(rig)
        if not said_ready(rig):
            return rig
        if calibration:
            shutil.copy(calibration, self.rig)
        daemon = run([options.bin / "scanrigd", "--config", self.rig / "rig.toml"], log)
        self.processes.insert(0, daemon)
        self.control = ControlClient(self.rig / "control.sock")
        threading.Thread(target=self.control.operate, daemon=True).start()
        return daemon

    def finish(self, job):
        """Saves the truth, hidden from the daemon, and the time stamps of the simulated devices."""
        self.control.request(write_truth=str(job.resolve()))
        stamps = {what: self.control.request(get=what)[what] for what in ("exposures", "legs", "changes")}
        (job / "stamps.json").write_text(json.dumps(stamps, indent=1) + "\n")


def run(command, log, **options):
    return subprocess.Popen([str(word) for word in command], **{"stdout": log, "stderr": log, **options})


def said_ready(rig):
    """Waits for the rig's ready line; False when the rig ends without it, or takes too long."""
    alarm = threading.Timer(RENDER_LIMIT_S, rig.kill)
    alarm.start()
    line = rig.stdout.readline()
    alarm.cancel()
    if not line:
        rig.wait()
    return bool(line)


def wait_for_socket(daemon, path):
    limit = time.monotonic() + START_LIMIT_S
    while time.monotonic() < limit and daemon.poll() is None:
        if path.exists():
            return True
        time.sleep(0.05)
    return False


class UncalibratedRig(SimulatedStation):
    """The same rig before it was calibrated, on a clock that need not be waited for."""

    def __init__(self, folder, options, log):
        super().__init__(folder)
        daemon = self.start(options, log, extra=["--own-calibration", "--operator", "helper", "--clock", "virtual"])
        if not wait_for_ready(options, daemon, self.socket):
            self.stop()
            raise RuntimeError("the rig to calibrate did not become ready")

    def stop(self):
        stop(self)


def wait_for_ready(options, daemon, path):
    if not wait_for_socket(daemon, path):
        return False
    limit = time.monotonic() + START_LIMIT_S
    while time.monotonic() < limit:
        status = subprocess.run([options.bin / "scanrig", "status", "--socket", path], capture_output=True, text=True)
        if "Operational.Ready" in status.stdout:
            return True
        time.sleep(0.2)
    return False


def stop(station):
    for process in station.processes:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()


def calibration_of(options, log):
    """The file that the rig has made, or None: it knows the truth."""
    if options.calibration == "true":
        return None
    if options.scale < SMALLEST_SCALE:
        print(f"Images of {options.scale:g} times the size do not show a board's markers: the true calibration is used")
        return None
    kept = demo_calibration.own_calibration(options, lambda folder: UncalibratedRig(folder, options, log), log)
    return kept / demo_calibration.CALIBRATION


def job_folder(jobs):
    """Record of the only job."""
    return max((p for p in jobs.iterdir() if p.is_dir()), key=lambda p: p.name)


def link_results(job, folder):
    """The job's files directly under `folder`, while they stay in the job folder."""
    for entry in job.iterdir():
        (folder / entry.name).symlink_to(os.path.relpath(entry, folder))


def print_accuracies(options, job, folder):
    """What the calibration costs: the same images with the rig's own and with the true one. Aligned: the shape alone."""
    true = folder / "true_calibration"
    demo_calibration.with_true_calibration(job, true)
    subprocess.run([options.bin / "scanrig", "reconstruct", true, "--no-texture", "--voxel-mm", str(VOXEL_MM)],
                   stdout=subprocess.DEVNULL, check=True)
    evaluated = subprocess.run([options.bin / "scanrig", "evaluate", true, "--json"], capture_output=True, text=True)
    print(f"Accuracy on the measured surface, {options.profile}")
    for name, text in (("own calibration", (folder / "scores.json").read_text()),
                       ("true calibration", evaluated.stdout)):
        scores = json.loads(text)
        measured, aligned = scores["measured"], scores["aligned"]
        print(f"  {name:<18} median {measured['median_mm']:.4f} mm, p95 {measured['p95_mm']:.4f} mm; "
              f"aligned {aligned['median_mm']:.4f} and {aligned['p95_mm']:.4f} mm")


def scores_of(options, folder):
    """Prints the table; returns the exit code of the evaluation."""
    evaluated = subprocess.run([options.bin / "scanrig", "evaluate", folder, "--json"], capture_output=True, text=True)
    if not evaluated.stdout:
        print(evaluated.stderr, end="", file=sys.stderr)
        return evaluated.returncode
    scores = json.loads(evaluated.stdout)
    (folder / "scores.json").write_text(evaluated.stdout)
    print("Scores against the truth (absolute frame, nothing aligned)")
    for gate in scores["gates"]:
        sign = "<=" if gate["at_most"] else ">="
        mark = "" if gate["ok"] else "   not reached"
        print(f"  {gate['name']:<44} {gate['measured']:>9.4f}   reach {sign} {gate['limit']:g}{mark}")
    return 0


def end_as_by_ctrl_c(*_):
    raise KeyboardInterrupt


def main():
    options = arguments()
    for end in (signal.SIGTERM, signal.SIGHUP):  # a terminal that is closed leaves no daemon behind
        signal.signal(end, end_as_by_ctrl_c)
    if options.wire and INSIDE not in os.environ:
        in_own_network(options)
    start = time.monotonic()
    folder = options.out
    if options.object and not options.object.is_file():
        return report_error(f"no such file: {options.object}", 3)
    in_the_way = make_room(folder)
    if in_the_way:
        return report_error(in_the_way, 3)
    log = open(folder / "demo.log", "w")
    station = (WireStation if options.wire else SimulatedStation)(folder)
    try:
        calibration = calibration_of(options, log)
        daemon = station.start(options, log, calibration)
        if not wait_for_socket(daemon, station.socket):
            stop(station)
            print((folder / "demo.log").read_text(), end="", file=sys.stderr)
            return daemon.returncode or 1
        if options.page:
            print("Open in a browser", flush=True)
            subprocess.run([options.bin / "scanrig", "open", "--role", "engineer", "--socket", station.socket])
        try:
            followed = subprocess.run([options.bin / "scanrig", "status", "--follow", "--socket", station.socket],
                                      timeout=JOB_LIMIT_S).returncode
        except subprocess.TimeoutExpired:
            return report_error(f"the job is not done after {JOB_LIMIT_S} s; see {folder}/demo.log", 1)
        if followed != 0:
            return followed
        job = job_folder(station.jobs)
        station.finish(job)
        if not options.keep and not options.page:
            stop(station)
        link_results(job, folder)
        scored = scores_of(options, folder)
        if calibration and scored == 0:
            print_accuracies(options, job, folder)
        print(f"Model   {folder}/model/model.glb\nReport  {folder}/model/report.json")
        print(f"Wall time {time.monotonic() - start:.1f} s")
        if options.page:
            print(f"Log another browser in: {options.bin}/scanrig open --socket {station.socket}\n"
                  "The rig and its page keep running: Ctrl-C ends them.", flush=True)
            daemon.wait()
        elif options.keep:
            print(f"The daemon keeps running (process {daemon.pid}); its state: "
                  f"scanrig status --socket {station.socket}")
        return scored
    except RuntimeError as failed:
        return report_error(failed, 1)
    except KeyboardInterrupt:
        return 130
    finally:
        if not options.keep:
            stop(station)


def in_own_network(options):
    """Runs this program again in a network namespace of its own, for the simulated cameras."""
    command = [options.bin / "scanrig-sim", "own-network", "--", sys.executable, *sys.argv]
    os.execve(command[0], [str(word) for word in command], {**os.environ, INSIDE: "1"})


if __name__ == "__main__":
    sys.exit(main())
