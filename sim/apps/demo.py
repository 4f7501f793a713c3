#!/usr/bin/env python3
"""./dev demo: one object through the simulated rig, from Start to the model and its scores against the truth."""
import argparse
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

START_LIMIT_S = 60
JOB_LIMIT_S = 3600


def arguments():
    parser = argparse.ArgumentParser(prog="./dev demo", description=__doc__)
    parser.add_argument("--object", type=pathlib.Path, help="OBJ, PLY or GLB to scan (default: the built-in figurine)")
    parser.add_argument("--height-mm", type=float, default=100.0, help="the object is scaled to this height")
    parser.add_argument("--seed", type=int, default=1, help="placements, noise, table errors")
    parser.add_argument("--views", type=int, default=8, help="views a pose")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/demo"), help="folder for the scan")
    parser.add_argument("--keep", action="store_true", help="leave the daemon running")
    parser.add_argument("--same-rest", action="store_true", help="the operator forgets to turn the object over")
    parser.add_argument("--scale", type=float, default=1.0, help="of the images: 0.25 gives 320x240")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    return parser.parse_args()


def complain(sentence, code):
    print(f"demo: {sentence}", file=sys.stderr)
    return code


def make_room(folder):
    """An empty folder: an earlier demo's is replaced, anything else is left alone. Returns what is in the way."""
    if folder.exists() and any(folder.iterdir()):
        if not (folder / "demo.log").is_file():
            return f"{folder} is not empty and not an earlier demo; name another folder with --out"
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return None


def daemon_command(options, socket, jobs):
    command = [options.bin / "scanrigd-sim", "--socket", socket, "--jobs", jobs, "--seed", options.seed,
               "--views", options.views, "--height-mm", options.height_mm, "--scale", options.scale]
    if options.object:
        command += ["--object", options.object]
    if options.same_rest:
        command += ["--same-rest"]
    return [str(word) for word in command]


def wait_for_socket(daemon, socket):
    limit = time.monotonic() + START_LIMIT_S
    while time.monotonic() < limit and daemon.poll() is None:
        if socket.exists():
            return True
        time.sleep(0.05)
    return False


def stop(daemon):
    if daemon.poll() is None:
        daemon.send_signal(signal.SIGTERM)
        try:
            daemon.wait(timeout=20)
        except subprocess.TimeoutExpired:
            daemon.kill()


def place_results(jobs, folder, keep):
    """The one job's files directly under `folder`: moved there, or linked while the daemon still serves them."""
    job = max((p for p in jobs.iterdir() if p.is_dir()), key=lambda p: p.name)
    for entry in job.iterdir():
        if keep:
            (folder / entry.name).symlink_to(os.path.relpath(entry, folder))
        else:
            entry.rename(folder / entry.name)
    if not keep:
        shutil.rmtree(jobs)


def scores_of(options, folder):
    """Prints the table; returns the exit code of the evaluation."""
    answer = subprocess.run([options.bin / "scanrig", "evaluate", folder, "--json"], capture_output=True, text=True)
    if not answer.stdout:
        print(answer.stderr, end="", file=sys.stderr)
        return answer.returncode
    scores = json.loads(answer.stdout)
    (folder / "scores.json").write_text(answer.stdout)
    print("Scores against the truth (absolute frame, nothing aligned)")
    for gate in scores["gates"]:
        sign = "<=" if gate["at_most"] else ">="
        mark = "" if gate["ok"] else "   not reached"
        print(f"  {gate['name']:<44} {gate['measured']:>9.4f}   reach {sign} {gate['limit']:g}{mark}")
    return 0


def main():
    options = arguments()
    began = time.monotonic()
    folder = options.out
    if options.object and not options.object.is_file():
        return complain(f"no such file: {options.object}", 3)
    in_the_way = make_room(folder)
    if in_the_way:
        return complain(in_the_way, 3)
    socket, jobs = folder / "api.sock", folder / "jobs"
    with open(folder / "demo.log", "w") as log:
        daemon = subprocess.Popen(daemon_command(options, socket, jobs), stdout=log, stderr=log)
    try:
        if not wait_for_socket(daemon, socket):
            stop(daemon)
            print((folder / "demo.log").read_text(), end="", file=sys.stderr)
            return daemon.returncode or 1
        try:
            followed = subprocess.run([options.bin / "scanrig", "status", "--follow", "--socket", socket],
                                      timeout=JOB_LIMIT_S).returncode
        except subprocess.TimeoutExpired:
            return complain(f"the job is not done after {JOB_LIMIT_S} s; see {folder}/demo.log", 1)
        if followed != 0:
            return followed
        if not options.keep:
            stop(daemon)
        place_results(jobs, folder, options.keep)
        scored = scores_of(options, folder)
        print(f"Model   {folder}/model/model.glb\nReport  {folder}/model/report.json")
        print(f"Wall time {time.monotonic() - began:.1f} s")
        if options.keep:
            print(f"The daemon keeps running (process {daemon.pid}); ask it with: scanrig status --socket {socket}")
        return scored
    finally:
        if not options.keep:
            stop(daemon)


if __name__ == "__main__":
    sys.exit(main())
