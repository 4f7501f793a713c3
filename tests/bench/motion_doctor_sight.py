"""Faults of cameras, light, calibration and machine that `scanrig doctor` must find, planted in the rig on the wire."""
import concurrent.futures
import datetime
import json
import os
import pathlib
import re
import sys

import motion_doctor
import motion_rig

RIG = ("--cameras", "gige", "--views", "3", "--poses", "1")
SMALL, LARGE = ("--scale", "0.25"), ("--scale", "0.5")  # rows are measured in large images only
ALWAYS = -1
WORKERS = 6  # each with a network of its own: the cameras' addresses are fixed
LIMIT_S = 600
OTHER_USER = 65534


def edit_calibration(rig, change):
    file = rig.folder / "calibration.json"
    calibration = json.loads(file.read_text())
    change(calibration)
    file.write_text(json.dumps(calibration))


def made(ago):
    return (datetime.datetime.now(datetime.timezone.utc) - ago).strftime("%Y-%m-%dT%H:%M:%SZ")


def make_sound(rig):
    """What a rig of today has beside the simulated one: a calibration of yesterday, and a machine set up for cameras."""
    edit_calibration(rig, lambda calibration: calibration.update(date=made(datetime.timedelta(days=1))))
    set_machine(rig, "proc/sys/net/core/rmem_max", 33554432)
    set_machine(rig, "sys/class/net/lo/speed", 1000)


def set_machine(rig, name, value):
    """A file of /proc or /sys as the doctor reads it with --machine-root."""
    file = rig.folder / "machine" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{value}\n")


def edit_both(rig, before, after):
    """Exchanges two texts of rig.toml."""
    text = rig.config.read_text()
    rig.config.write_text(re.sub(f"{before}|{after}", lambda found: {before: after, after: before}[found[0]], text))


def camera_fault(kind, *sides, count=ALWAYS):
    def plant(rig):
        for side in sides:
            rig.set(camera_fault=kind, camera=side, fault_count=count)
    return plant


def light(**levels):
    return lambda rig: rig.set(light=levels)


def turned(calibration):
    """The right camera has turned about its x axis by 0.4 px of its image."""
    camera = calibration["right"]
    pose = camera["camera_from_turntable"]
    tilt = 0.4 / camera["fy"]
    for part in (pose["rotation"], pose["translation"]):
        y, z = part[1], part[2]
        if isinstance(y, list):
            part[1] = [a - tilt * b for a, b in zip(y, z)]
            part[2] = [b + tilt * a for a, b in zip(y, z)]
        else:
            part[1], part[2] = y - tilt * z, z + tilt * y


def other_serial(calibration):
    calibration["left"]["serial"] = "40099999"


def lock_jobs(rig):
    (rig.folder / "jobs").mkdir()
    (rig.folder / "jobs").chmod(0o700)
    # The other user must get at everything else.
    (rig.folder / "gpio.sock").chmod(0o666)
    pathlib.Path(rig.folder / "turntable").resolve().chmod(0o666)


def old_calibration(rig):
    edit_calibration(rig, lambda calibration: calibration.update(date=made(datetime.timedelta(days=40))))
    rig.edit_config("[calibration]\n", "[calibration]\ncheck_every_h = 168\n")


def late_calibration(rig):
    edit_calibration(rig, lambda calibration: calibration.update(date=made(datetime.timedelta(days=-2))))


def cases():
    """Name, expected finding, what plants the fault, options of the rig, user who runs the doctor."""
    yield "a sound rig with cameras", None, lambda rig: None, LARGE
    # Cameras
    yield "a camera is unplugged", "camera_missing", lambda rig: rig.set(camera_unplugged=True, camera="right")
    yield "wrong serial number", "camera_settings", lambda rig: rig.edit_config('serial = "SIM-L"', 'serial = "SIM-X"')
    yield "exposure cut by the camera", "camera_settings", lambda rig: None, (*SMALL, "--max-exposure-us", "8000")
    yield "trigger wire broken", "no_trigger", camera_fault("missed", "left", "right")
    yield "frames lost", "frames_lost", camera_fault("lost", "right", count=6)
    yield "packets lost", "packets_lost", camera_fault("torn", "left", count=6)
    yield "lens cap left on", "dark_camera", camera_fault("dark", "left")
    yield "a lens out of focus", "focus_difference", camera_fault("blurred", "right")
    yield "cameras exchanged at their mounts", "cameras_swapped", camera_fault("swapped", "left", "right")
    yield "cameras exchanged in rig.toml", "cameras_swapped", lambda rig: edit_both(rig, "left = ", "right = ")
    yield "one image on both sides", "same_image", camera_fault("swapped", "left")
    # Light
    yield "both lamps dead", "no_light", light(pattern=0, plain=0)
    yield "the pattern's lamp dead", "no_pattern", light(pattern=0)
    yield "slide missing", "no_pattern", light(slide=False)
    yield "lines of the lamps exchanged", "lights_exchanged", lambda rig: edit_both(rig, "PROJ_TRIG", "PROJ_PLAIN")
    yield "the light never goes out", "light_stays_on", light(pattern=0, plain=0, room=1)
    yield "room light", "room_light", light(room=0.3)
    yield "too bright", "overexposed", light(pattern=40, plain=10)
    yield "a lamp that warms up", "light_unstable", light(change_per_s=0.01)
    # Calibration
    yield "calibration of another camera", "other_calibration", lambda rig: edit_calibration(rig, other_serial)
    yield "calibration too old", "calibration_old", old_calibration
    yield "a camera turned since", "calibration_moved", lambda rig: edit_calibration(rig, turned), LARGE
    # Machine
    yield "network of 100 Mbit/s", "slow_link", lambda rig: set_machine(rig, "sys/class/net/lo/speed", 100)
    yield "receive buffer too small", "receive_buffer", lambda rig: set_machine(rig, "proc/sys/net/core/rmem_max", 8192)
    yield "clock behind", "clock_behind", late_calibration
    yield "job disk full", "disk_full", lambda rig: rig.edit_config("reserve_gib = 1\n", "reserve_gib = 100000\n")
    yield "job folder of another user", "folder_not_writable", lock_jobs, SMALL, OTHER_USER


def trial(binaries, folder, plant, options=SMALL, as_user=None):
    """Ids of the doctor's findings, and its exit code."""
    with motion_rig.Rig(binaries, folder, *RIG, *options) as rig:
        make_sound(rig)
        plant(rig)
        return motion_doctor.consult(rig, present=False, as_user=as_user,
                                     options=("--machine-root", rig.folder / "machine"))


def inside(binaries, scratch, worker):
    for number, (_, _, *fault) in list(enumerate(cases()))[worker::WORKERS]:
        if len(fault) > 2 and os.geteuid() != 0:
            print(json.dumps([number, None, None]), flush=True)
            continue
        findings, code = trial(binaries, scratch / f"sight{worker}", *fault)
        print(json.dumps([number, findings, code]), flush=True)


def measure(bench, scratch):
    def work(worker):
        return bench.run([bench.bin / "scanrig-sim", "own-network", "--", sys.executable, __file__, bench.bin, scratch,
                          worker], LIMIT_S)

    with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
        ended = list(pool.map(work, range(WORKERS)))
    found = {}
    for done in ended:
        found |= {number: rest for number, *rest in map(json.loads, done.stdout.splitlines())}
        if done.returncode != 0:
            bench.note(done.stderr.strip()[-500:])
    for number, (name, finding, *_) in enumerate(cases()):
        what, asked = f"doctor: {name}", f"finds {finding or 'nothing'}, exit code {'5' if finding else '0'}"
        if number not in found:
            bench.line(what, asked, "ended early", False)
            continue
        ids, code = found[number]
        if ids is None:
            bench.line(what, asked, "not measured: needs root to become another user", None)
            continue
        bench.line(what, asked, f"{', '.join(ids) or 'nothing'}, exit code {code}",
                   ids == ([finding] if finding else []) and code == (5 if finding else 0))


if __name__ == "__main__":
    inside(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), int(sys.argv[3]))
