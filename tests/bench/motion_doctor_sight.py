"""Faults of cameras, light, calibration and machine that `scanrig doctor` must find, planted in the rig on the wire."""
import concurrent.futures
import datetime
import fcntl
import json
import os
import pathlib
import re
import socket
import struct
import sys
import time

import motion_doctor
import motion_rig

RIG = ("--cameras", "gige", "--views", "3", "--poses", "1")
SMALL, LARGE = ("--scale", "0.25"), ("--scale", "0.5")  # rows are measured in large images only
ALWAYS = -1
WORKERS = 4  # each with a network of its own: the cameras' addresses are fixed
LIMIT_S, LAST_TRIAL_S = 900, 150
OTHER_USER = 65534
MTU = 65536


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


def is_in_machine_network():
    """Whether this process is in the machine's network. In a namespace of an ordinary user, the first process is hidden."""
    try:
        return os.readlink("/proc/self/ns/net") == os.readlink("/proc/1/ns/net")
    except PermissionError:
        return False


def set_mtu(size):
    """Of the loopback, which carries the cameras' packets."""
    SIOCSIFMTU = 0x8922
    if os.geteuid() == 0 and is_in_machine_network():
        raise RuntimeError("run it by scanrig-sim own-network: this is the network of the machine")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, SIOCSIFMTU, struct.pack("16si12x", b"lo", size))


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


def several(*plants):
    """Faults that have nothing to do with each other."""
    def plant(rig):
        for one in plants:
            one(rig)
    return plant


def cases():
    """Faults, expected findings, what plants them, options of the rig, user who runs the doctor. Faults that do not hide
    each other share a rig: a rig takes half a minute."""
    small_buffer = several(lambda rig: set_machine(rig, "sys/class/net/lo/speed", 100),
                           lambda rig: set_machine(rig, "proc/sys/net/core/rmem_max", 8192))
    full_disk = lambda rig: rig.edit_config("reserve_gib = 1\n", "reserve_gib = 100000\n")
    yield "a sound rig with cameras", (), lambda rig: None, LARGE
    # Cameras
    yield "a camera is unplugged", ("camera_missing",), lambda rig: rig.set(camera_unplugged=True, camera="right")
    yield "wrong serial number", ("camera_settings",), lambda rig: rig.edit_config('serial = "SIM-L"', 'serial = "SIM-X"')
    yield "exposure cut by the camera", ("camera_settings",), lambda rig: None, (*SMALL, "--max-exposure-us", "8000")
    yield "packets larger than the network's", ("camera_settings",), lambda rig: set_mtu(4000)
    yield "trigger wire broken", ("no_trigger",), camera_fault("missed", "left", "right")
    yield "frames lost", ("frames_lost",), camera_fault("lost", "right", count=6)
    yield "packets lost", ("packets_lost",), camera_fault("torn", "left", count=6)
    yield "lens cap left on", ("dark_camera",), camera_fault("dark", "left")
    yield "a lens out of focus", ("focus_difference",), camera_fault("blurred", "right")
    yield "cameras exchanged at their mounts", ("cameras_swapped",), camera_fault("swapped", "left", "right")
    yield "one image on both sides", ("same_image",), camera_fault("swapped", "left")
    # Light
    yield "both lamps dead", ("no_light",), light(pattern=0, plain=0)
    yield "the pattern's lamp dead", ("no_pattern",), light(pattern=0)
    yield "slide missing", ("no_pattern",), light(slide=False)
    yield "lines of the lamps exchanged", ("lights_exchanged",), lambda rig: edit_both(rig, "PROJ_TRIG", "PROJ_PLAIN")
    yield "the light never goes out", ("light_stays_on",), light(pattern=0, plain=0, room=1)
    # Calibration and machine, some beside faults of the light
    yield ("room light; cameras exchanged in rig.toml", ("room_light", "cameras_swapped"),
           several(light(room=0.3), lambda rig: edit_both(rig, "left = ", "right = ")))
    yield ("a lamp that warms up; calibration of another camera", ("light_unstable", "other_calibration"),
           several(light(change_per_s=0.01), lambda rig: edit_calibration(rig, other_serial)))
    yield ("too bright; job disk full", ("overexposed", "disk_full"), several(light(pattern=40, plain=10), full_disk))
    yield "a camera turned since its calibration", ("calibration_moved",), lambda rig: edit_calibration(rig, turned), LARGE
    yield ("network of 100 Mbit/s; receive buffer too small; calibration too old",
           ("slow_link", "receive_buffer", "calibration_old"), several(small_buffer, old_calibration))
    yield ("clock behind; job folder of another user", ("clock_behind", "folder_not_writable"),
           several(late_calibration, lock_jobs), SMALL, OTHER_USER)


def trial(binaries, folder, plant, options=SMALL, as_user=None):
    """Ids of the doctor's findings, and its exit code."""
    with motion_rig.Rig(binaries, folder, *RIG, *options) as rig:
        set_mtu(MTU)
        make_sound(rig)
        plant(rig)
        return motion_doctor.consult(rig, present=False, as_user=as_user,
                                     options=("--machine-root", rig.folder / "machine"))


def results_of(scratch, worker):
    return scratch / f"sight{worker}.results"


def inside(binaries, scratch, worker):
    end = time.monotonic() + LIMIT_S - LAST_TRIAL_S
    with open(results_of(scratch, worker), "w") as results:
        for number, (_, _, *fault) in list(enumerate(cases()))[worker::WORKERS]:
            if time.monotonic() > end:
                sys.exit("no time left for the other faults")
            may_run = len(fault) < 3 or os.geteuid() == 0
            found = trial(binaries, scratch / f"sight{worker}", *fault) if may_run else None
            results.write(json.dumps([number, found]) + "\n")
            results.flush()


def measure(bench, scratch):
    def work(worker):
        return bench.run([bench.bin / "scanrig-sim", "own-network", "--", sys.executable, __file__, bench.bin, scratch,
                          worker], LIMIT_S)

    with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
        ended = list(pool.map(work, range(WORKERS)))
    found = {}
    for worker, done in enumerate(ended):
        if done.returncode != 0:
            bench.note(done.stderr.strip()[-500:])
        if results_of(scratch, worker).exists():
            found |= dict(map(json.loads, results_of(scratch, worker).read_text().splitlines()))
    for number, (name, findings, *_) in enumerate(cases()):
        what, code = f"doctor: {name}", 5 if findings else 0
        asked = f"finds {', '.join(findings) or 'nothing'}, exit code {code}"
        if number not in found:
            bench.line(what, asked, "ended early", False)
        elif found[number] is None:
            bench.line(what, asked, "not measured: needs root to become another user", None)
        else:
            ids, ended_with = found[number]
            bench.line(what, asked, f"{', '.join(ids) or 'nothing'}, exit code {ended_with}",
                       sorted(ids) == sorted(findings) and ended_with == code)


if __name__ == "__main__":
    inside(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), int(sys.argv[3]))
