"""Bad input of every kind: one sentence that names the file, the documented exit code, no leftovers, no changes."""
import hashlib
import json
import os
import pathlib
import shutil
import subprocess

from slowness import SLOWNESS

LIMIT_S = 120 * SLOWNESS
USAGE, BAD_INPUT, OUT_OF_RANGE, NO_MODEL = 2, 3, 5, 7  # docs/reference/exit-codes.md


def tree(folder):
    """Every file below with its hash."""
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
            for p in sorted(folder.rglob("*")) if p.is_file()}


class Desk:
    """A good small scan with its model, copies of it to damage, and the programs."""

    def __init__(self, binaries, scratch):
        self.bin = pathlib.Path(binaries).resolve()
        self.home = pathlib.Path(scratch).resolve() / "bad_input"
        shutil.rmtree(self.home, ignore_errors=True)
        self.home.mkdir(parents=True)
        self.good = self.home / "good"
        self.shoot(self.good)
        self.run("scanrig", "reconstruct", self.good, "--voxel-mm", 1, "--no-texture", check=True)

    def shoot(self, folder, *options):
        self.run("scanrig-sim", "shoot", "--views", 4, "--scale", 0.25, "--out", folder, *options, check=True)

    def run(self, program, *words, check=False):
        return subprocess.run([str(self.bin / program), *map(str, words)], capture_output=True, text=True,
                              timeout=LIMIT_S, cwd=self.home, check=check)

    def copy(self, name):
        folder = self.home / name
        shutil.copytree(self.good, folder)
        return folder

    def file(self, name, text):
        path = self.home / name
        path.write_text(text)
        return path


def verdict(desk, code, named, program, *words):
    """Runs a program, and compares all content of the desk before and after. Returns (ok, what was seen)."""
    before = tree(desk.home)
    done = desk.run(program, *words)
    told = done.stderr.strip()
    wrong = []
    if done.returncode != code:
        wrong.append(f"exit code {done.returncode} instead of {code}")
    if done.stderr.count("\n") != 1 or not told.startswith(f"{program}: "):
        wrong.append("not one sentence")
    if named not in told:
        wrong.append(f"does not name {named}")
    if tree(desk.home) != before:
        wrong.append("files were changed, left or lost")
    short = told.replace(f"{desk.home}/", "")
    return not wrong, f"{'; '.join(wrong) + ': ' if wrong else ''}{done.returncode}, {short}"


def edit_json(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    return content


def rebind_calibration(folder):
    """The manifest contains the hash of the calibration: a damaged calibration must not be masked by a wrong hash."""
    digest = hashlib.sha256((folder / "calibration.json").read_bytes()).hexdigest()
    edit_json(folder / "scan.json", lambda scan: scan["calibration"].update(sha256=digest))


def reconstruct(desk, folder, code, named):
    return verdict(desk, code, named, "scanrig", "reconstruct", folder, "--voxel-mm", 1, "--out", folder / "again")


def scan_cases(desk):
    folder = desk.copy("image_missing")
    (folder / "pose1/view02/left_pattern.png").unlink()
    yield "an image is missing", *reconstruct(desk, folder, BAD_INPUT, "pose1/view02/left_pattern.png")

    folder = desk.copy("view_missing")
    shutil.rmtree(folder / "pose2/view01")
    yield "a view's folder is missing", *reconstruct(desk, folder, BAD_INPUT, "pose2/view01")

    folder = desk.copy("view_unlisted")
    edit_json(folder / "scan.json", lambda scan: scan["poses"][1]["views"].pop(1))
    yield "the manifest lacks a view", *reconstruct(desk, folder, BAD_INPUT, "scan.json")

    folder = desk.copy("no_views")
    edit_json(folder / "scan.json", lambda scan: [pose["views"].clear() for pose in scan["poses"]])
    yield "the manifest has 0 views", *reconstruct(desk, folder, BAD_INPUT, "scan.json")

    folder = desk.copy("truncated")
    image = folder / "pose1/view01/right_plain.png"
    os.truncate(image, image.stat().st_size // 2)
    yield "a truncated PNG", *reconstruct(desk, folder, BAD_INPUT, "right_plain.png")

    folder = desk.copy("truncated_known")
    image = folder / "pose1/view01/right_plain.png"
    os.truncate(image, image.stat().st_size // 2)
    digest = hashlib.sha256(image.read_bytes()).hexdigest()
    edit_json(folder / "scan.json",
              lambda scan: scan["poses"][0]["views"][1]["files"]["right_plain"].update(sha256=digest))
    yield "a truncated PNG with its own hash", *reconstruct(desk, folder, BAD_INPUT, "right_plain.png")

    for name, value in (("nan", float("nan")), ("null", None)):
        folder = desk.copy(f"calibration_{name}")
        edit_json(folder / "calibration.json", lambda calibration: calibration["left"].update(fx=value))
        rebind_calibration(folder)
        yield f"a calibration with {name}", *reconstruct(desk, folder, BAD_INPUT, "calibration.json")

    folder = desk.copy("manifest_missing")
    (folder / "scan.json").unlink()
    yield "no manifest", *reconstruct(desk, folder, BAD_INPUT, "scan.json")

    yield "no such folder", *reconstruct(desk, desk.home / "nowhere", BAD_INPUT, "nowhere")
    yield "the model is already there", *verdict(desk, BAD_INPUT, "model", "scanrig", "reconstruct", desk.good)


def object_cases(desk):
    empty = desk.file("no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    target = desk.home / "never"
    yield "a mesh of zero faces to scan", *verdict(desk, BAD_INPUT, "no_faces.obj", "scanrig-sim", "shoot", "--object",
                                                   empty, "--out", target)
    yield "a mesh of zero faces for the daemon", *verdict(
        desk, BAD_INPUT, "no_faces.obj", "scanrigd-sim", "--object", empty, "--socket", target, "--jobs", target)
    folder = desk.copy("no_truth")
    (folder / "truth.ply").write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                                      "property float z\nelement face 0\n"
                                      "property list uchar int vertex_indices\nend_header\n")
    yield "a truth of zero faces", *verdict(desk, BAD_INPUT, "truth.ply", "scanrig", "evaluate", folder)
    yield "a missing mesh", *verdict(desk, BAD_INPUT, "gone.ply", "scanrig-sim", "shoot", "--object",
                                               desk.home / "gone.ply", "--out", target)
    for what, options in {"profile": ["--profile", "garage"], "effect": ["--profile", "2", "--without", "wobbel"],
                          "material": ["--profile", "2", "--material", "velvet"]}.items():
        yield f"a name of no {what}", *verdict(desk, BAD_INPUT, options[-1], "scanrig-sim", "shoot", *options, "--out", target)
    yield "a workshop without a calibration", *verdict(desk, BAD_INPUT, "--true-calibration", "scanrig-sim", "shoot",
                                                       "--profile", "workshop", "--out", target)
    yield "0 views to shoot", *verdict(desk, USAGE, "views", "scanrig-sim", "shoot", "--views", 0, "--out", target)
    yield "0 views for the daemon", *verdict(desk, USAGE, "views", "scanrigd-sim", "--views", 0, "--socket", target,
                                             "--jobs", target)
    yield "an object larger than the working volume", *verdict(
        desk, BAD_INPUT, "larger than the working volume", "scanrig-sim", "shoot", "--height-mm", 300, "--out", target)
    folder = desk.home / "oversize"
    desk.shoot(folder, "--height-mm", 300, "--any-size")
    yield "a scan of such an object", *reconstruct(desk, folder, OUT_OF_RANGE, "larger than the working volume")
    folder = desk.home / "same_rest"
    desk.shoot(folder, "--same-rest")
    yield "the same rest twice", *reconstruct(desk, folder, NO_MODEL, "not turned over")


def config_cases(desk, config):
    shutil.copytree(config.parent.parent, desk.home / "config")
    unknown = desk.file("config/rigs/unknown_key.toml", config.read_text().replace("[turntable]\n", "[turntable]\ncolour = \"red\"\n"))
    yield "a config with an unknown key", *verdict(desk, BAD_INPUT, "unknown_key.toml", "scanrig", "check-config", unknown)
    yield "the daemon with that config", *verdict(desk, BAD_INPUT, "unknown_key.toml", "scanrigd", "--config", unknown)
    yield "a missing config", *verdict(desk, BAD_INPUT, "gone.toml", "scanrig", "check-config", "gone.toml")
    target = desk.home / "never"
    yield "missing range scans", *verdict(desk, BAD_INPUT, "gone.conf", "scanrig", "import", "stanford",
                                                     "--pose", desk.home / "gone.conf", "--out", target)
    conf = desk.file("scans.conf", "bmesh gone.ply 0 0 0 0 0 0 1\n")
    yield "one missing range scan", *verdict(desk, BAD_INPUT, "gone.ply", "scanrig", "import", "stanford",
                                                     "--pose", conf, "--out", target)
    points = desk.file("points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                                     "property float z\nend_header\n0 0 0\n")
    letter = desk.file("letter.ply", "Dear Sir or Madam\n")
    for what, files, word in (("one scan alone", [points], "can be joined"), ("points without faces", [points, points], "no faces"),
                              ("a letter as a scan", [letter, points], "not a PLY file")):
        yield f"{what} to be joined", *verdict(desk, BAD_INPUT, word, "scanrig", "import", "meshes", *files, "--out", target)


def instrument_cases(desk, config):
    """Artefacts and flat images that are none."""
    yield "a model without the steps of a gauge", *verdict(desk, BAD_INPUT, "20.000, 30.000 mm", "scanrig", "acceptance",
                                                           "step-gauge", "--heights", "20,30", desk.good)
    yield "a limit of another artefact", *verdict(desk, BAD_INPUT, "flatness", "scanrig", "acceptance", "sphere", "--diameter",
                                                  25, "--limit", "flatness=0.1", desk.good)
    flats, target = desk.home / "flats", desk.home / "never"
    desk.run("scanrig-sim", "shoot-flats", "--scale", 0.25, "--dark-pairs", 1, "--exposures-us", "500,2000,8000,12500", "--out",
             flats, check=True)

    def characterise(folder, named, *options):
        return verdict(desk, BAD_INPUT, named, "scanrig", "camera", "characterise", "--from", folder, "--out", target, *options)

    yield "an overexposed flat", *characterise(flats, "left_12500us_01: overexposed", "--config", "none.toml")
    for image in flats.glob("*_12500us_*.png"):
        image.unlink()
    yield "flats of other cameras", *characterise(flats, "SIM-L", "--config", config)
    shutil.copytree(flats, folder := desk.home / "one_of_a_pair")
    (folder / "right_2000us_02.png").unlink()
    yield "one flat of a pair", *characterise(folder, "right_2000us_01.png", "--config", "none.toml")
    shutil.copytree(flats, folder := desk.home / "two_sizes")
    desk.run("scanrig-sim", "shoot-flats", "--scale", 0.3, "--dark-pairs", 1, "--exposures-us", "500,2000", "--out",
             desk.home / "larger", check=True)
    shutil.copyfile(desk.home / "larger/left_2000us_01.png", folder / "left_2000us_02.png")
    yield "flats of two sizes", *characterise(folder, "384 x 288", "--config", "none.toml")
    shutil.copytree(flats, folder := desk.home / "underexposed")
    for number in (1, 2):
        shutil.copyfile(flats / f"left_dark_0{number}.png", folder / f"left_500us_0{number}.png")
    yield "an underexposed flat", *characterise(folder, "left_500us_01: underexposed", "--config", "none.toml")


def cases(binaries, scratch, config):
    """Yields (name, ok, what was seen). `config`: a valid rig.toml."""
    desk = Desk(binaries, scratch)
    yield from scan_cases(desk)
    yield from object_cases(desk)
    yield from config_cases(desk, pathlib.Path(config))
    yield from instrument_cases(desk, pathlib.Path(config))
