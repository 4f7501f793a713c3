"""Texts for every alarm, the frames of the manuals, a job's record of its moves; and ten thousand turns."""
import concurrent.futures
import json
import re
import tomllib

import motion_rig

TURNS_LIMIT_S = 3000
DRIFT_DEG = 0.01
TOLERANCE_DEG = 0.02  # of the rig's configuration
WOUND_UP = 2384       # turns from zero, two before the 32-bit counter is full: 10,000 pulses, 90:1
WOUND_UP_GRBL = 64    # two before GRBL cannot report the position: 32 bits of thousandths of a motor degree
TURNS_AT_ONCE = 3
GOLDEN_TESTS = "turntable_driver_test"


def turns(bench, root, scratch):
    """From zero, and from near either end of each drive's counter."""
    drives = {profile.stem: (profile, WOUND_UP) for profile in sorted((root / "config" / "drives").glob("*.toml"))}
    drives["grbl"] = ("grbl", WOUND_UP_GRBL)
    plan = []
    for name, (drive, wound_up) in drives.items():
        lengths = bench.pick(full=(10000, 500, 500), sampled=(1000, 100, 100), quick=(100, 30, 30))
        plan += [(name, drive, *run) for run in zip(lengths, (0, wound_up, -wound_up), ("up", "up", "down"))]

    def go(number):
        _, drive, count, preload, way = plan[number]
        return bench.run([bench.bin / "turns", drive, scratch / f"turns{number}", count, preload, way], TURNS_LIMIT_S)

    with concurrent.futures.ThreadPoolExecutor(TURNS_AT_ONCE) as pool:
        ended = list(pool.map(go, range(len(plan))))
    for (name, _, count, preload, way), done in zip(plan, ended):
        seen = json.loads(done.stdout) if done.stdout.startswith("{") else {}
        told = (f"{seen.get('turns', 0)} turns, drift {seen.get('drift_deg', float('nan')):.4f} deg, angle told within "
                f"{seen.get('worst_angle_deg', float('nan')):.4f} deg, longest way {seen.get('longest_way_deg', 0):.0f} deg")
        ok = done.returncode == 0 and seen["turns"] >= count and seen["drift_deg"] <= DRIFT_DEG \
            and seen["worst_angle_deg"] <= DRIFT_DEG
        bench.line(f"{name}: {count} turns {way}, counter begins {preload} turns from home",
                   f"no way longer than a turn, drift <= {DRIFT_DEG} deg", told + (done.stderr and f": {done.stderr.strip()}"),
                   ok)


def alarms(bench, root, scratch):
    """Each code of each profile, raised by the simulated drive and read by the shipped driver."""
    for profile in sorted((root / "config" / "drives").glob("*.toml")):
        words = {int(str(code), 0): text for code, text in
                 tomllib.loads(profile.read_text()).get("alarm", {}).get("words", {}).items()}
        try:
            rig = motion_rig.Rig(bench.bin, scratch / f"alarm-{profile.stem}", "--drive", profile.stem)
        except RuntimeError:
            bench.line(f"alarms of {profile.stem} in words", f"{len(words)} codes",
                       "not measured: the simulated rig has no such drive", None)
            continue
        told = 0
        with rig:
            for code, text in words.items():
                rig.set(alarm=code)
                done = bench.run([bench.bin / "scanrig", "turntable", "status", "--json", "--config", rig.config], 20)
                told += done.returncode == 0 and text in json.loads(done.stdout)["alarm"]
                rig.set(power_cycle=True)
        bench.line(f"alarms of {profile.stem} in words", f"{len(words)} codes", f"{told} told in the profile's words",
                   bool(words) and told == len(words))


def golden(bench):
    done = bench.run([bench.test_program(GOLDEN_TESTS), "--gtest_filter=*Golden*:*Frame*"], 120)
    ran = re.search(r"\[==========\] (\d+) tests? from .* ran", done.stdout)
    count = int(ran.group(1)) if ran else 0
    bench.line("frames of the manuals byte for byte", "all tests pass",
               f"{count} tests, {'all pass' if done.returncode == 0 else 'some FAIL'}", done.returncode == 0 and count > 0)


def job_tells(bench, scratch):
    """One small job on the wire: every view with its angles and times."""
    with motion_rig.Rig(bench.bin, scratch / "job", "--speed-deg-s", "180", "--acceleration-deg-s2", "1000", "--views",
                        "4", "--poses", "1") as rig:
        rig.start_daemon()
        views = []
        if rig.get_ready():
            rig.tap("start")
            rig.wait(lambda: any(job["state"] in ("reconstructing", "done", "failed")
                                 for job in (rig.ask("jobs") or {"jobs": []})["jobs"]), 60, 0.1)
            scans = list((rig.folder / "jobs").glob("*/scan.json"))
            views = [view for scan in scans for pose in json.loads(scan.read_text())["poses"] for view in pose["views"]]
    whole = [view for view in views if view["settling_ms"] > 0 and view["moving_ms"] >= 0]
    off = [abs((view["measured_deg"] - view["commanded_deg"] + 180) % 360 - 180) for view in whole]
    bench.line("accuracy and settle time of each move in the job", f"4 views, within {TOLERANCE_DEG} deg",
               f"{len(whole)} views, worst {max(off, default=float('nan')):.4f} deg, settling "
               f"{max((view['settling_ms'] for view in whole), default=0):.0f} ms at most",
               len(whole) == 4 and max(off) <= TOLERANCE_DEG)


def words(bench, root, scratch):
    golden(bench)
    alarms(bench, root, scratch)
    job_tells(bench, scratch)
