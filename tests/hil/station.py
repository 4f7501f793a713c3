"""The station in the virtual machine, with the simulated turntable of the host at its serial port."""
import hashlib
import http.client
import json
import os
import pathlib
import re
import shutil
import sys
import threading
import time

import image
import machine

sys.path.insert(0, str(image.ROOT / "tests" / "bench"))
import motion_rig  # noqa: E402

VIEWS = 8
PROGRAMS = ["scanrigd", "scanrig", "scanrig-edge-camera"]  # programs that run in the machine
READY = "Operational.Ready"
JOBS = "/var/lib/scanrig/jobs"
CONFIGS = image.HERE / "configs"
# Same as for a package installed in a running system.
INSTALL = ("mkdir /run/app && mount -t squashfs -o ro /dev/vdd /run/app && cp -a /run/app/. / && umount /run/app && "
           "systemd-sysusers scanrig.conf && systemd-tmpfiles --create scanrig.conf && "
           "udevadm control --reload && udevadm trigger -s gpio && udevadm settle -t 10 && "
           "systemctl daemon-reload && systemctl start hil-cameras")
IMAGES = [f"{side}_{light}.png" for side in ("left", "right") for light in ("pattern", "plain")]


class Unmet(RuntimeError):
    """A required event did not happen."""


def make_tree(build, tree, images):
    """Files installed in the booted machine: the project, its configurations, the cameras and their images."""
    image.run("cmake", "--install", build, "--prefix", "/usr", "--strip", env={**os.environ, "DESTDIR": str(tree)})
    configs, programs = tree / "etc" / "scanrig", tree / "usr" / "lib" / "hil"
    for folder in (configs, programs):
        folder.mkdir(parents=True, exist_ok=True)
    image.run("strip", "-o", programs / "scanrig-edge-camera", build / "bin" / "scanrig-edge-camera")
    shutil.copy(CONFIGS / "rig.toml", configs)
    for name in ("usb-and-gige.toml", "vivid.toml"):
        other = with_sections(CONFIGS / "rig.toml", CONFIGS / name)
        (configs / name).write_text(other)
    (configs / "shipped.toml").write_text(shipped_example())
    shutil.copytree(images, tree / "usr" / "share" / "hil" / "images")
    calibration = tree / "usr" / "share" / "hil" / "images" / "calibration.json"  # of the GigE pair, if of any
    calibration.write_text(calibration.read_text().replace("SIM-L", "40012345").replace("SIM-R", "40012346"))


def shipped_example():
    """config/rigs/example.toml as shipped; only the addresses of the two cameras differ."""
    text = (image.ROOT / "config" / "rigs" / "example.toml").read_text()
    for side, serial, end in (("left", "40012345", 11), ("right", "40012346", 12)):
        before, after = (f'\n{side} = {{ serial = "{serial}", address = "{net}.{end}" }}'
                         for net in ("192.168.10", "10.77.0"))
        if text.count(before) != 1:
            raise RuntimeError(f"config/rigs/example.toml does not have once: {before.strip()}")
        text = text.replace(before, after)
    return text


def with_sections(config, sections):
    """Configuration in which these sections replace its own."""
    def split(file):
        parts = re.split(r"^(?=\[)", file.read_text(), flags=re.M)
        return {part.split("]")[0]: part.rstrip() + "\n\n" for part in parts}

    return "".join({**split(config), **split(sections)}.values())


def install(folder, system, app, port):
    """Boots, unless an earlier run has kept that; installs the content of `app`; returns the start of every life."""
    booted, installed = system / "booted", folder / "installed"
    with machine.Machine(folder, system, app, port, booted if booted.is_file() else None) as fresh:
        fresh.wait_for_boot()
        if not booted.is_file():
            fresh.do("systemctl start hil.target", 60)  # returns when the target is reached
            fresh.keep(booted)
        fresh.do(INSTALL)
        fresh.keep(installed)
    return installed


class Station:
    """One life of the machine, until the block ends."""

    def __init__(self, folder, system, app, rig, installed):
        self.rig = rig
        self.machine = machine.Machine(folder, system, app, rig.folder / "turntable", installed)
        self.told = None  # angle last sent to the cameras
        self.job = None  # job started last
        self.leaving = threading.Event()
        self.teller = threading.Thread(target=self.tell_angle, daemon=True)

    def __enter__(self):
        try:
            self.machine.wait_for_boot()
            self.plug_serial(True)
            self.machine.do(f"date -s @{time.time():.3f} && systemctl start --no-block scanrigd.socket multi-user.target")
        except BaseException:
            self.machine.kill()
            raise
        self.teller.start()
        return self

    def __exit__(self, *_):
        self.leaving.set()
        if self.teller.is_alive():
            self.teller.join()
        self.machine.kill()

    def tell_angle(self):
        """The cameras in the machine see the table at the angle of the host's simulation."""
        while not self.leaving.wait(0.02):
            angle = round(self.rig.truth()["angle_deg"], 1)
            if angle != self.told:
                try:
                    self.machine.eyes.send(str(angle))
                except machine.Gone:
                    return
                self.told = angle

    def plug_serial(self, plugged):
        if plugged:
            self.machine.qmp("device_add", driver="usb-serial", id="adapter", bus="usb.0", chardev="turntable")
        else:
            self.machine.qmp("device_del", id="adapter")

    def wire_uart(self):
        """Moves the drive's cable from the USB adapter to the machine's second 16550A."""
        self.plug_serial(False)
        self.machine.unplug_chardev("turntable")
        self.machine.qmp("chardev-change", id="uart",
                         backend={"type": "serial", "data": {"device": str(self.rig.folder / "turntable")}})

    # Actions of the operator

    def pull(self, line, up):
        self.machine.do(f"echo pull-{'up' if up else 'down'} >/run/hil/{line}/pull")

    def tap(self, line):
        self.machine.do(f"cd /run/hil/{line} && echo pull-down >pull && sleep 0.2 && echo pull-up >pull")

    def press_estop(self, pressed):
        """The contact opens, and the relay takes the motor's power."""
        self.pull("ESTOP_OK", pressed)
        (self.rig.press if pressed else self.rig.release)("estop")

    def lamp(self, name):
        return self.machine.do(f"cat /run/hil/{name}/value") == "1"

    # The daemon

    def ask(self, what):
        wire = http.client.HTTPConnection("127.0.0.1", self.machine.http_port, timeout=5)
        try:
            wire.request("GET", f"/api/v1/{what}", headers={"Host": "rig"})
            answer = wire.getresponse()
            return json.loads(answer.read()) if answer.status == 200 else None
        except (OSError, http.client.HTTPException, ValueError):
            return None
        finally:
            wire.close()

    def status(self):
        return self.ask("status")

    def says(self):
        """State of the station, and problems of its devices."""
        status = self.status()
        if not status:
            return "the station does not answer"
        wrong = [device["problem"]["message"] for device in status["devices"] if not device["ok"]]
        return "; ".join([f"the station says: {status['machine']}, {status['sentence']}", *wrong])

    def wait(self, what, ready, limit_s):
        """Result of `ready`, once it is true. Fails with Unmet."""
        end = time.monotonic() + limit_s
        while True:
            found = ready()
            if found:
                return found
            if time.monotonic() > end:
                raise Unmet(f"not {what} within {limit_s} s; {self.says()}")
            time.sleep(0.2)

    def wait_for_words(self, key, words, limit_s):
        def ready():
            status = self.status()
            return status if status and words in status.get(key, "") else None

        return self.wait(f'"{words}" in {key}', ready, limit_s)

    def get_ready(self):
        """Halted until the operator presses Reset; then it homes."""
        def asks():
            status = self.status()
            return status and ("Reset" in status["next_action"] or status["machine"] == READY) and status["machine"]

        if self.wait("asking for Reset", asks, 60) != READY:
            self.tap("RESET")
        self.wait("ready with all its devices", lambda: self.is_ready(self.status()), 60)

    @staticmethod
    def is_ready(status):
        return status and status["machine"] == READY and all(device["ok"] for device in status["devices"])

    def start(self):
        """Id of the new job."""
        before = set(self.jobs())
        self.tap("START")
        self.job = self.wait("a new job", lambda: next(iter(set(self.jobs()) - before), None), 10)
        return self.job

    def jobs(self):
        return self.machine.do(f"ls {JOBS} 2>/dev/null || true").split()

    def manifest(self, job):
        """Content of scan.json on the disk; empty before the first view."""
        text = self.machine.do(f"cat {JOBS}/{job}/scan.json 2>/dev/null || echo '{{}}'")
        return json.loads(text)

    def views(self, job):
        return [view for pose in self.manifest(job).get("poses", []) for view in pose["views"]]

    def image_hashes(self, job):
        lines = self.machine.do(f"cd {JOBS}/{job} && find . -name '*.png' -exec sha256sum {{}} +").splitlines()
        return {name.removeprefix("./"): digest for digest, name in (line.split() for line in lines)}

    def journal(self, words="-u scanrigd", lines=40):
        return self.machine.do(f"journalctl --no-pager -o cat {words} -n {lines}")


def pixels_hash(file):
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()
