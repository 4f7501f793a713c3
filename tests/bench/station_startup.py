"""From the start of the shipped daemon to its first reply, to devices that are ready or report why not, to the state
that the rules require.

Two of the devices are simulated GigE cameras: this file runs again in a network of its own.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import time

import motion_rig

API_LIMIT_S, DEVICES_LIMIT_S, STATE_LIMIT_S = 1.0, 10.0, 60.0
OLD_JOBS = 500
OPTIONS = ("--cameras", "gige", "--scale", "0.25", "--views", "4", "--poses", "1")


def boot(rig, devices, state):
    """Seconds to the API's first reply, to known states of the devices, to the state; None for missing events."""
    begun = time.monotonic()
    rig.start_shipped_daemon(wait=False)

    def until(seen):
        return time.monotonic() - begun if rig.wait(lambda: seen(rig.status() or {}), STATE_LIMIT_S, 0.01) else None

    return until(bool), until(devices), until(state)


def problems(status):
    return {device["name"]: device["problem"] for device in status.get("devices", []) if not device["ok"]}


def require_devices(status):
    return len(status.get("devices", [])) == 4 and not problems(status)  # turntable, projector, camera, panel


def missing(name):
    """The problem is named, with its cause."""
    return lambda status: bool((problems(status).get(name) or {"message": ""})["message"])


def machine_is(*states):
    return lambda status: status.get("machine") in states


def guarded(rig):
    rig.edit_config('home_after_restart = "on_reset"', 'home_after_restart = "guarded"')


def old_jobs(rig):
    """As many job folders as a year leaves, and no index of them."""
    def ask(*words):
        subprocess.run([rig.bin / "scanrig", *words, "--socket", rig.api], check=True, capture_output=True, timeout=20)

    boot(rig, require_devices, machine_is("Halted"))
    ask("queue")
    job = rig.ask("jobs")["jobs"][0]["id"]
    ask("cancel", job)
    rig.kill_daemon(15)
    jobs = rig.folder / "jobs"
    for number in range(OLD_JOBS):
        copy = jobs / f"20200101-000000-{number + 1}"
        shutil.copytree(jobs / job, copy)
        scan = json.loads((copy / "scan.json").read_text())
        (copy / "scan.json").write_text(json.dumps(dict(scan, id=copy.name), indent=2))
    (jobs / "index.sqlite").unlink()


def as_it_is(_):
    pass


def other_camera(rig):
    rig.edit_config('left = { serial = "', 'left = { serial = "another-')


def unplugged(section, key):
    """The device that the section names is missing."""
    def change(rig):
        before, after = rig.config.read_text().split(f"[{section}]", 1)
        head, line = after.split(f"\n{key} =", 1)
        line, tail = line.split("\n", 1)
        rig.config.write_text(f'{before}[{section}]{head}\n{key} = "{rig.folder / "unplugged"}"\n{tail}')
    return change


HALTED = machine_is("Halted")
CASES = {"all devices there": (as_it_is, require_devices, HALTED, "Halted"),
         "guard closed, homing without Reset allowed": (guarded, require_devices, machine_is("Operational.Ready"), "Ready"),
         f"{OLD_JOBS} jobs and no index": (old_jobs, require_devices, HALTED, "Halted"),
         "camera unplugged": (other_camera, missing("camera"), HALTED, "Halted"),
         "turntable unplugged": (unplugged("turntable", "device"), missing("turntable"), machine_is("Error"), "Error"),
         "panel unplugged": (unplugged("gpio", "socket"), missing("panel"), machine_is("Error"), "Error")}


def inside(binaries, scratch):
    for name, (change, devices, state, _) in CASES.items():
        with motion_rig.Rig(binaries, scratch / "startup", *OPTIONS) as rig:
            change(rig)
            seen = boot(rig, devices, state)
            print(json.dumps([name, seen, None if None not in seen else rig.status()]), flush=True)


def measure(bench, scratch):
    done = bench.run([bench.bin / "scanrig-sim", "own-network", "--", sys.executable, __file__, bench.bin, scratch], 900)
    seen = {name: rest for name, *rest in map(json.loads, done.stdout.splitlines())}
    if len(seen) < len(CASES):
        bench.note(done.stderr.strip()[-500:])
    for name, (_, _, _, state) in CASES.items():
        (api, devices, settled), said = seen.get(name, ((None, None, None), None))
        if said:
            bench.note(json.dumps(said))
        bench.at_most(f"start, {name}: API up", API_LIMIT_S, api, "s", 2)
        bench.at_most(f"start, {name}: devices known, with cause where not", DEVICES_LIMIT_S, devices, "s", 2)
        bench.line(f"start, {name}: then", state, f"never {state}" if settled is None else f"{state} after {settled:.2f} s",
                   settled is not None)


if __name__ == "__main__":
    inside(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
