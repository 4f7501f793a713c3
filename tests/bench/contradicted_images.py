"""One image of a scan contradicts the others: whether reconstruction names it, and what the model loses."""
import json
import random
import shutil

import change_image

VIEWS, CASES = 16, 60
# Of each kind of change: its share of the cases, what has to be named, and whether colours are needed for it.
KINDS = {"sticker": (15, ("silhouette", "photograph"), True), "tint": (15, ("silhouette", "photograph"), True),
         "shadow": (8, ("photograph",), True), "reflection": (7, ("photograph", "silhouette"), True),
         "crept": (15, ("object moved",), False)}
ONLY_HANDLING = ("--profile", "workshop", "--without", "optics,sensor,projector,materials,turntable,drift,room",
                 "--material", "matt", "--true-calibration")
MAX_LOSS = 0.01


def shoot(bench, folder, *options):
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", folder, "--views", VIEWS, "--poses", 1, "--scale", 0.5, *options],
              600, check=True)
    return folder


def reconstruct(bench, scan, has_colour):
    """The report, and what failed otherwise."""
    options = () if has_colour else ("--no-texture",)
    done = bench.run([bench.bin / "scanrig", "reconstruct", scan, "--voxel-mm", 0.5, *options], 300)
    if done.returncode != 0:
        return None, done.stderr.strip()[-200:]
    return json.loads((scan / "model" / "report.json").read_text()), ""


def measured_mm2(report):
    return report["mesh"]["area_mm2"] * report["mesh"]["measured_share"]


def names(report):
    return [(d["what"], d["view"], d["camera"]) for d in report["disagreements"]]


def cases(count):
    """Kind, view and camera of each; every kind among the first."""
    chance = random.Random(7)
    listed = [kind for kind, (share, _, _) in KINDS.items() for _ in range(share)]
    chance.shuffle(listed)
    first = list(KINDS)
    for kind in first:
        listed.remove(kind)
    return [(kind, chance.randrange(1, VIEWS), chance.choice(("left", "right"))) for kind in (first + listed)[:count]]


class Tally:
    def __init__(self):
        self.named, self.wrongly, self.worst, self.missed, self.cases = 0, [], 0.0, [], 0

    def add(self, case, report, error, sound_mm2):
        kind, view, camera = case
        self.cases += 1
        if report is None:
            self.missed.append(f"{kind} in view {view}: {error}")
            return
        found = names(report)
        right = [n for n in found if n[0] in KINDS[kind][1] and n[1] == view and n[2] in (camera, None)]
        self.named += 1 if right else 0
        if not right:
            self.missed.append(f"{kind} in view {view}, {camera}")
        self.wrongly += [f"{kind} {view}: {n[0]} {n[1]} {n[2]}" for n in found if n[1] != view]
        self.worst = max(self.worst, 1.0 - measured_mm2(report) / sound_mm2)


def contradicted(bench, scratch):
    base, crept = shoot(bench, scratch / "sound"), shoot(bench, scratch / "crept", *ONLY_HANDLING, "--with", "creep",
                                                         "--spoil-all")
    workshop = shoot(bench, scratch / "workshop", "--profile", "workshop", "--true-calibration")
    sound = {}
    for name, scan in (("laboratory", base), ("workshop", workshop)):
        sound[name], error = reconstruct(bench, scan, True)
        named = error or "; ".join(d["sentence"] for d in sound[name]["disagreements"])
        bench.line(f"sound scan, {name}: images named", "none", named or "none", not named)
    sound_mm2 = measured_mm2(sound["laboratory"])
    tally = Tally()
    count = bench.pick(CASES, CASES, len(KINDS))
    for number, case in enumerate(bench.in_time(cases(count))):
        kind, view, camera = case
        scan = scratch / f"case{number}"
        change_image.copy(base, scan, kind, view, camera, number, crept)
        tally.add(case, *reconstruct(bench, scan, KINDS[kind][2]), sound_mm2)
        shutil.rmtree(scan)
    for text in tally.missed + tally.wrongly:
        bench.note(text)
    bench.line("1 of 32 silhouettes, 16 views or 64 images changed: named", f"{count} of {count}",
               f"{tally.named} of {tally.cases}", tally.named == count)
    bench.line("the same: other images named", "none", str(len(tally.wrongly) or "none"), not tally.wrongly)
    bench.at_most("the same: measured surface lost, worst case", 100 * MAX_LOSS, 100 * tally.worst, "%", digits=2)
