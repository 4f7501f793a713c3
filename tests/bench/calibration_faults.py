"""Series of board images in which one thing is wrong: named, and no grade that is not deserved."""
import json
import re

import calibration_series

REFUSED, NOT_A, ANY = "refused", "not A", "any"


class Fault:
    """`shoot` and `calibrate`: options. `words`: what must be said. `grade`: the best one it may get."""

    def __init__(self, name, shoot, words, grade, calibrate=()):
        self.name, self.shoot, self.words, self.grade, self.calibrate = name, shoot, words, grade, calibrate


FAULTS = [
    Fault("blurred image", ["--faults", "blurred=1"], r"[Bb]lurred.*focus", ANY),
    Fault("board slipped", ["--faults", "slip=0.3"], r"Board slipped in placement \d: fix it", NOT_A),
    Fault("camera knocked", ["--faults", "knock=0.3"], r"camera moved after placement \d .*clamp it", NOT_A),
    Fault("wrong board", ["--board", "10x7"], r"board", REFUSED, ["--board", "12x9"]),
    Fault("print 0.3 %, second length", ["--print", "scale=0.003,scale-sigma=0"],
          r"Second length differs by 0\.\d+ %: measure both", REFUSED,
          ["--length", "100", "0.01", "--second-length", "100.3", "0.01"]),
    Fault("left and right swapped", ["--rig", "swapped=1"], r"swapped: exchange the serials", REFUSED),
    Fault("table reversed", ["--rig", "reversed=1"], r"turns the other way: change the sign", REFUSED),
    Fault("gear wrong", ["--rig", "gear=0.01"], r"Table turns [\d.]+ of the reported angle: check", REFUSED),
    Fault("glare", ["--print", "glare=5"], r"Glare on \d+ % of the board\. Shorten", ANY),
    Fault("cut-off board", ["--faults", "cut-off=90"], r"partly outside the image|into view|too few corners", ANY),
    Fault("focus changed", ["--faults", "focus=0.002"], r"Focus of the (left|right) camera changed .*lock", REFUSED),
    Fault("cold rig", ["--faults", "cold=0.3"], r"camera drifted by 0\.\d+ px: let the rig warm up", NOT_A),
]
SCALE = ["--scale", "0.5"]
RANK = {"A": 0, "B": 1, "C": 2, "refused": 3}


def is_deserved(fault, grade):
    return {REFUSED: grade == "refused", NOT_A: RANK[grade] > RANK["A"], ANY: True}[fault.grade]


def one(bench, fault, seed, scratch):
    """(named, deserved) of one series."""
    folder = scratch / f"{fault.name.replace(' ', '_').replace(',', '')}_{seed}"
    calibration_series.shoot(bench, folder, seed, [*SCALE, *fault.shoot])
    done = calibration_series.calibrate(bench, folder, [*calibration_series.RIM_DOTS, *fault.calibrate])
    said = done.stdout + done.stderr
    try:
        grade = json.loads(done.stdout)["grade"]
    except (ValueError, KeyError):
        grade = "refused"
    is_named = re.search(fault.words, said) is not None
    if not is_named or not is_deserved(fault, grade):
        bench.note(f"{fault.name}, seed {seed}: grade {grade}, exit {done.returncode}: {' '.join(said.split())[-400:]}")
    calibration_series.remove(folder)
    return is_named, is_deserved(fault, grade) and (done.returncode == 0) == (grade != "refused")


def measure(bench, scratch):
    seeds = range(1, 1 + bench.pick(full=5, sampled=2, quick=1))
    named = deserved = count = 0
    for fault in bench.in_time(FAULTS):
        for seed in seeds:
            is_named, is_graded = one(bench, fault, seed, scratch)
            named, deserved, count = named + is_named, deserved + is_graded, count + 1
    wanted = len(FAULTS) * len(seeds)
    bench.line(f"{wanted} faults of {len(FAULTS)} kinds", "all named, with what to do", f"{named} of {count}",
               named == wanted)
    bench.line("the same", "none accepted with a grade it does not deserve", f"{count - deserved} of {count}",
               deserved == wanted)
