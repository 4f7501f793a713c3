"""From the start of the daemon to its first answer, to devices that are there or said why not, to the state of the rules."""
import json
import shutil
import time

import motion_rig

API_LIMIT_S, DEVICES_LIMIT_S = 1.0, 10.0
OLD_JOBS = 500


def boot(rig, settled):
    """Seconds to the API's first answer and to `settled`; None for what does not come."""
    begun = time.monotonic()
    rig.start_daemon(wait=False)
    api = time.monotonic() - begun if rig.wait(rig.status, 30, 0.01) else None
    done = time.monotonic() - begun if rig.wait(lambda: settled(rig.status() or {}), 30, 0.01) else None
    return api, done


def problems(status):
    return {device["name"]: device["problem"] for device in status.get("devices", []) if not device["ok"]}


def known(status):
    return len(status.get("devices", [])) == 4  # turntable, projector, camera, panel


def halted(status):
    return status.get("machine") == "Halted" and known(status) and not problems(status)


def without(name):
    """Something is missing: it is named, with its cause, and nothing can move."""
    def settled(status):
        named = problems(status)
        return set(named) == {name} and named[name]["message"] and status["machine"] in ("Halted", "Error")
    return settled


def guarded(rig):
    rig.edit_config('home_after_restart = "on_reset"', 'home_after_restart = "guarded"')


def old_jobs(rig):
    """As many folders of ended jobs as a year leaves, and no index of them."""
    rig.start_daemon()
    made = rig.bin / "scanrig"
    motion_rig.subprocess.run([made, "queue", "--socket", rig.api], check=True, capture_output=True, timeout=20)
    job = rig.ask("jobs")["jobs"][0]
    motion_rig.subprocess.run([made, "cancel", job["id"], "--socket", rig.api], check=True, capture_output=True,
                              timeout=20)
    rig.kill_daemon(15)
    folder = rig.folder / "jobs" / job["id"]
    for number in range(OLD_JOBS):
        copy = folder.with_name(f"20200101-000000-{number:03}")
        shutil.copytree(folder, copy)
        scan = json.loads((copy / "scan.json").read_text())
        (copy / "scan.json").write_text(json.dumps(dict(scan, id=copy.name), indent=2))
    (rig.folder / "jobs" / "index.sqlite").unlink(missing_ok=True)


def nothing(_):
    pass


def cut(section, line):
    """The section's device points nowhere."""
    def change(rig):
        text = rig.config.read_text()
        head, tail = text.split(f"[{section}]", 1)
        rig.config.write_text(head + f"[{section}]" + "\n".join(
            f'{line} = "{rig.folder / "unplugged"}"' if word.startswith(line + " =") else word
            for word in tail.split("\n")))
    return change


CASES = [("all devices there", (), nothing, halted, "Halted"),
         ("guard closed, homing without Reset allowed", (), guarded,
          lambda status: status.get("machine") == "Operational.Ready", "Ready"),
         (f"{OLD_JOBS} jobs and no index", (), old_jobs, halted, "Halted"),
         ("turntable unplugged", (), cut("turntable", "device"), without("turntable"), "named, nothing moves"),
         ("panel unplugged", ("--panel", "modbus-io"), cut("panel", "device"), without("panel"),
          "named, nothing moves")]


def measure(bench, scratch):
    for name, options, change, settled, state in CASES:
        with motion_rig.Rig(bench.bin, scratch / "startup", *options) as rig:
            change(rig)
            api, done = boot(rig, settled)
            if done is None:
                bench.note(json.dumps(rig.status()))
        bench.at_most(f"start, {name}: API up", API_LIMIT_S, api, "s", 2)
        bench.line(f"start, {name}: devices known, {state}", f"<= {DEVICES_LIMIT_S:.0f} s",
                   f"{done:.2f} s" if done is not None else "never", done is not None and done <= DEVICES_LIMIT_S)
