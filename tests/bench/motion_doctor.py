"""`scanrig doctor` against six faults of drive, panel and access; those of cameras, light and machine: motion_doctor_sight."""
import concurrent.futures
import json
import os
import subprocess

import motion_rig

FAST = ("--speed-deg-s", "180", "--acceleration-deg-s2", "1000")
LIMIT_S = 120
PROMPT_PRESS, PROMPT_RELEASE, PROMPT_ENTER = "Press the emergency stop", "Release the emergency stop", "press Enter"
PROMPT_SIGN, PROMPT_MARK, PROMPT_MARK_OFF = "which way", "Put a mark", "By how many degrees"


def consult(rig, present=True, as_user=None, options=("--allow-motion",)):
    """Runs the doctor and plays the operator: ids of its findings, each as often as it is found, and its result."""
    command = [rig.bin / "scanrig", "doctor", "--config", rig.config, "--json", *options]
    if present:
        command.append("--interactive")

    def become():
        if as_user is not None:
            os.setgroups([])
            os.setgid(as_user)
            os.setuid(as_user)

    process = subprocess.Popen([str(word) for word in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, preexec_fn=become)
    def answer(text):
        process.stdin.write(text + "\n")
        process.stdin.flush()

    marked_deg = 0.0
    for prompt in process.stderr:
        if PROMPT_PRESS in prompt:
            rig.press("estop")
        elif PROMPT_RELEASE in prompt:
            rig.release("estop")
            if PROMPT_ENTER in prompt:
                answer("")
        elif PROMPT_SIGN in prompt:
            # The operator has watched the table: home is 0, the quarter turn ends at +90 or at -90 (or, from there, at
            # 270) in the true angle.
            answer("ccw" if rig.truth()["angle_deg"] % 360 < 180 else "cw")
        elif PROMPT_MARK in prompt:
            marked_deg = rig.truth()["angle_deg"]
            answer("")
        elif PROMPT_MARK_OFF in prompt:
            answer(f"{(rig.truth()['angle_deg'] - marked_deg + 180) % 360 - 180:.0f}")
        if process.poll() is not None:
            break
    text = process.stdout.read()
    code = process.wait(timeout=LIMIT_S)
    rig.release("estop")
    try:
        return [finding["id"] for finding in json.loads(text)["findings"]], code
    except ValueError:
        return [], code


def cases():
    """Name, expected finding, setting to falsify, options of the doctor, options of the rig."""
    def swap(rig):
        os.symlink(os.readlink(rig.folder / "panel"), rig.folder / "other")
        rig.edit_config(f'device = "{rig.folder}/turntable"', f'device = "{rig.folder}/other"')

    def wrong_gear(rig):
        rig.edit_config("gear_ratio = 90", "gear_ratio = 72")
        if rig.drive == "grbl":  # GRBL keeps acceleration in motor units: as set by an installer who assumes 72
            rig.edit_config("acceleration_deg_s2 = 1000", "acceleration_deg_s2 = 1250")

    yield "a sound rig", None, lambda rig: None, {}, ()
    yield "wrong gear ratio", "gear_ratio", wrong_gear, {}, ()
    for drive in motion_rig.DRIVES[1:]:
        yield f"a sound rig, {drive}", None, lambda rig: None, {}, ("--drive", drive)
        yield f"wrong gear ratio, {drive}", "gear_ratio", wrong_gear, {}, ("--drive", drive)
    yield "reversed sign", "reversed_sign", lambda rig: rig.set(positive="cw"), {}, ()
    yield "wrong parity", "wrong_parity", lambda rig: rig.set(line={"parity": "even"}), {}, ()
    yield "swapped adapter", "swapped_adapter", swap, {}, ("--panel", "modbus-io")
    yield "e-stop not wired", "estop_not_wired", lambda rig: rig.set(wiring={"estop": "bridged"}), {}, ()
    if os.geteuid() == 0:
        def strict(rig):
            port = os.path.realpath(rig.folder / "turntable")
            os.chmod(port, 0o660)
            for folder in (rig.folder, *rig.folder.parents):
                if folder.stat().st_mode & 0o005 != 0o005:
                    raise PermissionError(f"{folder} cannot be entered by another user")
            os.chmod(rig.folder / "gpio.sock", 0o666)
            (rig.folder / "jobs").mkdir()
            (rig.folder / "jobs").chmod(0o777)

        yield "missing group", "missing_group", strict, {"as_user": 65534, "present": False}, ()
    else:
        yield "missing group", "missing_group", None, {}, ()


def attempt(bench, folder, finding, spoil, how, options):
    """Result of the doctor, as a line's end: measured and ok."""
    if spoil is None:
        return "not measured: needs root to become another user", None
    with motion_rig.Rig(bench.bin, folder, *FAST, *options) as rig:
        try:
            spoil(rig)
            findings, code = consult(rig, **how)
        except PermissionError as refused:
            return f"not measured: {refused}", None
    wanted = [finding] if finding else []
    return f"{', '.join(findings) or 'nothing'}, exit code {code}", findings == wanted and (code != 0) == bool(wanted)


def measure(bench, scratch):
    tried = list(cases())
    with concurrent.futures.ThreadPoolExecutor(len(tried)) as pool:
        ended = list(pool.map(lambda n: attempt(bench, scratch / f"doctor{n}", *tried[n][1:]), range(len(tried))))
    for (name, finding, *_), (measured, ok) in zip(tried, ended):
        bench.line(f"doctor: {name}", f"finds {finding or 'nothing'}, exit code {'not 0' if finding else '0'}", measured, ok)
