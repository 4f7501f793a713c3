"""A calibration that no longer holds: what the scan's own refinement makes of it, and which part it names."""
import copy
import json
import math

import calibration_series
import real_rig_scans
from calibration_watch import move_axis, times, turn_right_camera

SEED = 4200
FACTOR = 1.3


def lengthen_baseline(mm):
    """The right camera moves away from the left one."""
    def centre(camera):
        pose = camera["camera_from_turntable"]
        inverse = [list(row) for row in zip(*pose["rotation"])]
        return [-c for c in times(inverse, pose["translation"])]

    def change(calibration):
        left, right = centre(calibration["left"]), centre(calibration["right"])
        line = [b - a for a, b in zip(left, right)]
        length = math.sqrt(sum(c * c for c in line))
        pose = calibration["right"]["camera_from_turntable"]
        moved = times(pose["rotation"], [mm * c / length for c in line])
        pose["translation"] = [a - b for a, b in zip(pose["translation"], moved)]
    return change


# What is off, and what its sentence names; None: the scan cannot know it, and the drift check or a second length can.
CHANGES = {"0.1 px across rows": (turn_right_camera(0, 0.1), "amera"),
           "0.1 px along rows": (turn_right_camera(1, 0.1), "amera"),
           "axis by 0.1 mm and 0.05 deg": (move_axis(0.1, 0.05), "Table axis"),
           "baseline by 0.01 mm": (lengthen_baseline(0.01), None)}


def median_and_sentences(bench, scan, model, mode):
    report, failure = real_rig_scans.reconstruct(bench, scan, model, "--watch", mode)
    if report is None:
        return None, [failure]
    said = [sentence for pose in report["poses"] for sentence in (pose["watch"] or {"sentences": []})["sentences"]]
    return real_rig_scans.evaluate(bench, scan, model)["aligned"]["median_mm"], list(dict.fromkeys(said))


def measure(bench, scratch):
    scan, model = real_rig_scans.shoot(bench, scratch / "scan", ["--seed", SEED]), scratch / "model"
    known = json.loads(real_rig_scans.own_calibration(bench).read_text())
    sound, said = median_and_sentences(bench, scan, model, "refine")
    bench.line("calibration as solved: the scan says", "nothing", " ".join(said) or "nothing", sound is not None and not said)
    for name, (change, word) in bench.in_time(CHANGES.items()):
        other = copy.deepcopy(known)
        change(other)
        file = scratch / "off.json"
        file.write_text(json.dumps(other))
        calibration_series.replace_calibration(scan, file)
        before, _ = median_and_sentences(bench, scan, model, "off")
        after, said = median_and_sentences(bench, scan, model, "refine")
        figures = f"{before:.4f} mm, {after:.4f} mm" if before and after else f"no model: {' '.join(said)}"
        bench.line(f"calibration off, {name}: median without and with refinement",
                   f"refined within {FACTOR} of the undisturbed", f"{figures}; undisturbed {sound:.4f} mm", after is not None and after <= FACTOR * sound)
        if word:
            bench.line(f"calibration off, {name}: named", word, " ".join(said) or "nothing", word in " ".join(said))
        else:
            bench.note(f"{name}: the scan says {' '.join(said) or 'nothing'}; a second length or the drift check shows it")
