"""One pose through the kernel's interfaces, and the faults; each function is a row of the table."""
import json
import random
import re
import struct
import time

from station import IMAGES, JOBS, VIEWS, Unmet

SCAN_S = 120
RECOVERY_S = 60
UNITS = "scanrigd.socket scanrigd.service"  # both: a client that connects to the socket starts the daemon
CONFIGS = "/etc/scanrig"
UART_DEG = 40.0
MOST_EXPOSURE = 2.0
FAILURES = 6  # one more failure in a row than systemd allows a unit by default
FAILS = "[Service]\\nExecStart=\\nExecStart=/bin/false\\nExecStopPost=\\nRestartSec=200ms\\n"
PAIRS, VIVID_SIZE = 8, (320, 180)


def expect(true, what):
    if not true:
        raise Unmet(what)


def unit(station):
    """The daemon under its own unit."""
    station.wait("active", lambda: station.machine.call("systemctl is-active scanrigd")[1].strip() == "active", 60)
    text = station.machine.do("systemctl show scanrigd -p StatusText --value")
    expect("Reset" in text or "homed" in text, f"STATUS is {text!r}")
    failed = station.machine.do("systemctl --failed --plain --no-legend")
    expect(not failed, f"failed units: {failed}")
    judged = station.machine.do("systemd-analyze security --no-pager scanrigd | tail -1")
    user = station.machine.do("ps -o user= -C scanrigd")
    expect(user.split() == ["scanrig"], f"it runs as {user}")
    exposure = float(judged.split(":", 1)[1].split()[0])
    expect(exposure <= MOST_EXPOSURE, f"its exposure is {exposure}")
    return f"{exposure} exposure, user scanrig"


def failing(station):
    """A daemon that cannot start is restarted repeatedly and keeps its socket; once it starts, clients get replies."""
    drop_in = "/run/systemd/system/scanrigd.service.d"
    station.machine.do(f"mkdir -p {drop_in} && printf '{FAILS}' >{drop_in}/fails.conf && systemctl daemon-reload && "
                       "systemctl restart scanrigd; true", 60)

    def tried():
        return int(station.machine.do("systemctl show scanrigd -p NRestarts --value"))

    failed = station.wait(f"tried {FAILURES} times", lambda: (n := tried()) >= FAILURES and n, 60)
    code, words = station.machine.call("timeout 30 scanrig status 2>&1")
    expect(code not in (0, 124), f"scanrig status of a daemon that cannot begin: exit code {code}, {words}")
    station.machine.do(f"rm -r {drop_in} && systemctl daemon-reload && systemctl stop scanrigd", 60)
    socket = station.machine.do("systemctl is-active scanrigd.socket || true")
    expect(socket == "active", f"after {failed} failures the socket is {socket}")
    station.machine.do("scanrig status", 60)
    expect(station.machine.do("systemctl is-active scanrigd") == "active", "the daemon was not started by who connected")
    return f"{failed} failures, socket active; told: {words.strip().splitlines()[-1]}"


def wait_for_views(station, job, count, limit_s=SCAN_S):
    def stored():
        known = station.ask(f"jobs/{job}")
        if known and known["state"] in ("failed", "interrupted", "cancelled"):
            raise Unmet(f"job {job} is {known['state']}: {(known['error'] or {}).get('message', 'no reason given')}")
        return known and len(known["stored"]) >= count

    station.wait(f"{count} views stored", stored, limit_s)


def pose(station, rendered):
    """Start pressed at the panel; one pose of 8 views. `rendered`: sha256 by file of what the cameras show."""
    if station.job:
        end_job(station)
        station.machine.do(f"systemctl start {UNITS}", 60)
    station.get_ready()
    begin = time.monotonic()
    job = station.start()
    wait_for_views(station, job, VIEWS)
    took = time.monotonic() - begin
    station.wait("a complete pose", lambda: [p["complete"] for p in station.manifest(job)["poses"]] == [True], 20)
    stored = station.image_hashes(job)
    names = [f"pose1/view{view:02}/{image}" for view in range(VIEWS) for image in IMAGES]
    wrong = [name for name in names if stored.get(name) != rendered[name]]
    expect(not wrong, f"{len(wrong)} of {len(names)} images are not those that were shown: {', '.join(wrong[:4])}")
    off = max(abs(view["measured_deg"] - view["commanded_deg"]) for view in station.views(job))
    return f"{VIEWS} views, {len(names)} images byte for byte, {off:.4f} deg off at most, {took:.0f} s"


def usb_and_gige(station, rendered):
    """The same with a LightCrafter behind vhci-hcd, whose trigger output exposes two GigE cameras."""
    trigger = 'TRIGGER=lightcrafter 3240\nCAMERAS=gige 10.77.0.11 10.77.0.12'
    station.machine.do(f"echo '{trigger}' >/run/hil/cameras && systemctl restart hil-cameras && modprobe vhci_hcd")
    station.told = None  # the angle must be sent again
    attach = "ip netns exec cameras usbip attach -r 127.0.0.1 -b 1-1"
    station.wait("the LightCrafter attached", lambda: station.machine.call(attach)[0] == 0, 20)
    end_job(station)
    station.machine.do(f"cp {CONFIGS}/usb-and-gige.toml {CONFIGS}/rig.toml && systemctl start {UNITS}", 60)
    for device in ("projector", "camera"):
        station.wait(f"the {device} there", lambda name=device: device_is_there(station, name), 30)
    return pose(station, rendered)


def shipped_example(station, rendered):
    """config/rigs/example.toml: from Reset to the last view of pose 2. The cameras show the images of pose 1 twice."""
    station.machine.do("echo 'CAMERAS=gige 10.77.0.11 10.77.0.12' >/run/hil/cameras && systemctl restart hil-cameras")
    station.told = None  # the angle must be sent again
    end_job(station)
    station.machine.do(f"cp {CONFIGS}/shipped.toml {CONFIGS}/rig.toml && "
                       "install -o scanrig -g scanrig /usr/share/hil/images/calibration.json /var/lib/scanrig/ && "
                       f"scanrig check-config {CONFIGS}/rig.toml && systemctl start {UNITS}", 60)
    station.wait("the cameras there", lambda: device_is_there(station, "camera"), 30)
    station.get_ready()
    begin = time.monotonic()
    job = station.start()
    wait_for_views(station, job, VIEWS)
    station.wait("the flip requested", lambda: station.lamp("FLIP") and station.lamp("LAMP_AMBER"), 30)
    station.tap("START")
    wait_for_views(station, job, 2 * VIEWS)
    took = time.monotonic() - begin
    expect(not station.lamp("FLIP"), "the lamp that requests the flip is still lit")

    def state_after_scanning():
        state = station.ask(f"jobs/{job}")["state"]
        return state if state in ("reconstructing", "done") else None

    state = station.wait("the job beyond scanning", state_after_scanning, 30)
    scan = station.manifest(job)
    complete = [(pose["complete"], len(pose["views"])) for pose in scan["poses"]]
    expect(complete == [(True, VIEWS)] * 2 and scan["state"] == "scanned", f"scan.json: {scan['state']}, {complete}")
    formats = {view["pixel_format"] for view in station.views(job)}
    expect(formats == {"BayerRG8"}, f"pixel formats: {formats}")
    stored = station.image_hashes(job)
    names = [f"view{view:02}/{image}" for view in range(VIEWS) for image in IMAGES]
    wrong = [f"pose{pose}/{name}" for pose in (1, 2) for name in names
             if stored.get(f"pose{pose}/{name}") != rendered[f"pose1/{name}"]]
    expect(not wrong, f"{len(wrong)} of {2 * len(names)} images are not those that were shown: {', '.join(wrong[:4])}")
    return f"2 poses, {2 * VIEWS} views, {2 * len(names)} images byte for byte, {took:.0f} s; then {state}"


def uart(station):
    """The table homed and turned with the command line, at a serial port of the machine's own."""
    end_job(station)
    station.wire_uart()
    station.wait("the USB adapter's port gone", lambda: station.machine.call("test -e /dev/ttyUSB0")[0] != 0, 10)
    station.machine.do("ln -sf /dev/ttyS1 /dev/scanrig/turntable")
    port = station.machine.do("grep ^1: /proc/tty/driver/serial")
    expect("16550A" in port, f"the port is {port}")
    move = f"scanrig turntable move {UART_DEG} --yes --json --config {CONFIGS}/rig.toml"
    moved = json.loads(station.machine.do(move))
    off = abs(moved["measured_deg"] - UART_DEG)
    truth = station.rig.truth()["angle_deg"] % 360
    expect(off < 0.02 and abs(truth - UART_DEG) < 0.1, f"asked for {UART_DEG} deg: {moved}, truth {truth:.3f} deg")
    return f"ttyS1, 16550A: home, then {moved['measured_deg']:.3f} deg; truth {truth:.3f} deg"


def vivid(station):
    """The V4L2 driver on a capture driver of the kernel's own, frames by a timer."""
    end_job(station)
    station.machine.do("modprobe vivid && udevadm settle -t 10")
    config = f"--light none --config {CONFIGS}/vivid.toml"
    tuned = station.machine.do(f"scanrig camera tune --count {PAIRS} {config}")
    bright = [float(percent) for percent in re.findall(r"brightness +([\d.]+) %", tuned)]
    expect(len(bright) == 2 * PAIRS and min(bright) > 20, f"the command line says: {tuned}")
    station.machine.do(f"rm -rf /run/hil/grab && scanrig camera grab --out /run/hil/grab {config}")
    for side in ("left", "right"):
        head = bytes.fromhex(station.machine.do(f"head -c 24 /run/hil/grab/{side}.png | od -An -v -tx1"))
        size = struct.unpack(">II", head[16:])
        expect(head[:4] == b"\x89PNG" and size == VIVID_SIZE, f"{side}.png is not an image of {VIVID_SIZE}: {head}")
    return f"{PAIRS} pairs seen, brightness {min(bright):.0f} to {max(bright):.0f} %; one grabbed, {size[0]}x{size[1]}"


def end_job(station):
    """Stops the station and removes its job's folder: in an emulated machine a reconstruction would take minutes."""
    away = f" && rm -rf {JOBS}/{station.job}" if station.job else ""
    station.machine.do(f"systemctl stop {UNITS}{away}", 60)
    station.job = None


def scanning(station):
    """A job with a view stored, still running: the one that proved that the rig recovered, or a new one."""
    known = station.job and station.ask(f"jobs/{station.job}")
    if not known or known["state"] != "scanning" or len(known["stored"]) > VIEWS / 2:
        station.get_ready()
        station.start()
    wait_for_views(station, station.job, 1)
    return station.job


def job_ends(station, job, words):
    """Message of the job, once it has failed with one of `words`."""
    def ended():
        known = station.ask(f"jobs/{job}")
        return known if known and known["state"] in ("failed", "interrupted") else None

    known = station.wait("the job's end", ended, RECOVERY_S)
    sentence = (known["error"] or {}).get("message", "")
    expect(any(word in sentence for word in words), f"the job ended as: {sentence}")
    return known["state"], sentence


def recovers(station):
    """Presses Reset at the panel, and the next job takes a view. It continues, for the next fault."""
    station.get_ready()
    wait_for_views(station, station.start(), 1)


def serial_unplugged(station):
    job = scanning(station)
    station.plug_serial(False)
    state, sentence = job_ends(station, job, ("turntable",))
    station.wait("no port", lambda: station.machine.call("test -e /dev/scanrig/turntable")[0] != 0, 10)
    station.plug_serial(True)
    station.wait("the turntable back", lambda: device_is_there(station, "turntable"), 30)
    latency = station.machine.do("cat /sys/bus/usb-serial/devices/ttyUSB*/latency_timer")
    expect(latency == "1", f"the adapter's latency is {latency} ms")
    recovers(station)
    return f"job {state}: {sentence}; latency {latency} ms"


def device_is_there(station, name):
    status = station.status()
    return status and any(device["name"] == name and device["ok"] for device in status["devices"])


def estop(station):
    job = scanning(station)
    station.press_estop(True)
    state, sentence = job_ends(station, job, ("e-stop",))
    station.wait("the red lamp", lambda: station.lamp("LAMP_RED"), 5)
    station.press_estop(False)
    recovers(station)
    return f"job {state}: {sentence}"


def cameras_lost(station):
    """Both cameras stop delivering frames; then they return."""
    job = scanning(station)
    station.machine.do("systemctl stop hil-cameras")
    state, sentence = job_ends(station, job, ("camera",))
    station.machine.do("systemctl start hil-cameras")
    station.told = None  # the angle must be sent again
    recovers(station)
    return f"job {state}: {sentence}"


def turning(station):
    """A job whose table is turning now."""
    job = scanning(station)
    station.wait("the table turning", lambda: station.rig.truth()["speed_deg_s"] > 20, 20)
    return job


def seen_safe(station, begin):
    """Seconds from `begin` until the table is stopped and the light is off, by the simulation and the lines."""
    station.wait("the table standing", lambda: station.rig.truth()["stopped"], 30)
    took = time.monotonic() - begin
    dark = station.machine.do("cat /run/hil/PROJ_TRIG/value /run/hil/PROJ_PLAIN/value").split()
    expect(dark == ["0", "0"], f"the light is on: {dark}")
    return took


def killed(station):
    """The configuration is missing when the daemon dies, and back before it restarts."""
    job = turning(station)
    away = f"mv {CONFIGS}/rig.toml {CONFIGS}/away.toml; trap 'mv {CONFIGS}/away.toml {CONFIGS}/rig.toml' EXIT"
    begin = time.monotonic()
    # The lamp is red until the daemon runs again: read inside the machine.
    red = "for i in {1..100}; do read -r red </run/hil/LAMP_RED/value; [ $red = 1 ] && exit; sleep 0.1; done; exit 1"
    lit, _ = station.machine.call(f"{away}; systemctl kill -s SIGKILL --kill-whom=main scanrigd; {red}")
    expect(lit == 0, f"the red lamp has not been lit; {station.journal()}")
    took = seen_safe(station, begin)
    station.wait_for_words("next_action", "Reset", RECOVERY_S)
    known = station.ask(f"jobs/{job}")
    expect(known["state"] == "interrupted", f"the job is {known['state']}")
    recovers(station)
    return f"rig.toml away: standing and dark {took:.1f} s later, red lamp; restarted: Halted, job interrupted"


def watchdog(station):
    job = turning(station)
    station.machine.do("systemctl kill -s SIGSTOP --kill-whom=main scanrigd")
    begin = time.monotonic()
    station.wait("killed by the watchdog", lambda: "watchdog" in station.journal("-u scanrigd -u init.scope", 80).lower(),
                 30)
    took = time.monotonic() - begin
    seen_safe(station, begin)
    station.wait_for_words("next_action", "Reset", RECOVERY_S)
    known = station.ask(f"jobs/{job}")
    expect(known["state"] == "interrupted", f"the job is {known['state']}")
    recovers(station)
    return f"systemd's watchdog ended it after {took:.1f} s; made safe, restarted: Halted, job interrupted"


class Acknowledged:
    """Views that the station reported as stored, and whether they still are after the machine was killed."""

    def __init__(self):
        self.job, self.views = None, set()
        self.kills, self.checked, self.lost = 0, 0, 0

    def kill(self, station, max_s):
        """Random time during a scan, at most `max_s` after the view that is stored by now."""
        self.job, self.views = scanning(station), set()
        end = time.monotonic() + random.uniform(0, max_s)
        while True:
            known = station.ask(f"jobs/{self.job}") or {}
            self.views |= {view["view"] for view in known.get("stored", [])}
            if time.monotonic() > end:
                break
        station.machine.kill()
        self.kills += 1

    def check(self, station):
        """Check in the next life. The manifest has every acknowledged view, and the files match it."""
        station.wait("the daemon", station.status, 60)
        manifest = {view["index"]: view for view in station.views(self.job)}
        hashes = station.image_hashes(self.job)
        for index in self.views:
            files = manifest.get(index, {}).get("files", {})
            whole = len(files) == len(IMAGES) and all(hashes.get(f["path"]) == f["sha256"] for f in files.values())
            self.lost += not whole
            self.checked += 1
        state = (station.ask(f"jobs/{self.job}") or {}).get("state")
        expect(state not in (None, "scanning"), f"after the kill the job is {state}")
