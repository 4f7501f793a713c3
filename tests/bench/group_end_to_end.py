"""From end to end: Start to model in the simulated rig, real scans through the same pipeline, bad input, power cuts."""
import json
import pathlib
import shutil
import time

import bad_input
import bare_machine
import dragon
import d415_pair
import sigkill
import truth_absent

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEMO = ROOT / "sim" / "apps" / "demo.py"
SEEDS = (1, 2, 3)


def two_cores(command):
    return ["taskset", "-c", "0,1", *command]


def objects(bench):
    """Name and mesh of each requested object; None where the data are absent."""
    meshes = bench.data / "meshes" if bench.data else None
    yield "figurine", []
    for name, file in (("spot", "spot/spot_triangulated.obj"), ("igea", "igea_tri.ply")):
        yield name, ["--object", meshes / file] if meshes else None


def demo(bench, folder, options, calibration="true"):
    """The bars on models are those of matching and fusion: the laboratory, where the rig knows the truth."""
    shutil.rmtree(folder, ignore_errors=True)
    command = ["python3", DEMO, "--bin", bench.bin, "--out", folder, "--calibration", calibration, "--profile", "laboratory",
               *options]
    began = time.monotonic()
    done = bench.run(command, 3600)
    return done, time.monotonic() - began


def demo_itself(bench, folder, done, seconds):
    wanted = ["scan.json", "model/model.glb", "model/model.ply", "model/report.json", "truth.ply", "truth.json"]
    absent = [name for name in wanted if not (folder / name).is_file()]
    bench.line("demo ends with exit code 0", "0", done.returncode, done.returncode == 0)
    bench.line("files under DIR", ", ".join(wanted), f"absent: {', '.join(absent)}" if absent else "all", not absent)
    if absent:
        return
    header = (folder / "model/model.ply").read_bytes()[:2000].decode("ascii", "replace").partition("end_header")[0]
    properties = [line.split()[-1] for line in header.splitlines() if line.startswith("property")]
    bench.line("model.ply has views and sigma", "both", " ".join(properties), {"views", "sigma"} <= set(properties))
    views = sum("view" in line for line in done.stdout.splitlines())
    ends = ["model.glb", "report.json", "Scores", "Wall time"]
    bench.line("demo prints a line per view, then paths, scores, wall time", "16 lines, all four",
               f"{views} lines, {sum(word in done.stdout for word in ends)} of 4",
               views >= 16 and all(word in done.stdout for word in ends))
    report = json.loads((folder / "model/report.json").read_text())
    bench.profile = report.get("profile_sha256", "")
    missing = truth_absent.report_gaps(report)
    bench.line("report.json holds all that is asked", "all", ", ".join(missing) or "all", not missing)
    table = bench.run([bench.bin / "scanrig", "evaluate", folder], 300).stdout
    gates = [gate for gate in "ABCDE" if any(line.startswith(f"{gate} ") for line in table.splitlines())]
    bench.line("scanrig evaluate prints gates A to E", "A B C D E", " ".join(gates), len(gates) == 5)
    help_text = bench.run(["python3", DEMO, "--help"], 30).stdout
    options = ("--object", "--height-mm", "--seed", "--views", "--out", "--keep")
    absent = [option for option in options if option not in help_text]
    bench.line("demo takes its options", " ".join(options), "all" if not absent else f"not {absent}", not absent)
    bench.line("demo, Start to scores, this machine", "reported", f"{seconds:.0f} s on {bench.cores} cores", True)


def accuracy(bench, name, seed, folder):
    scores = json.loads((folder / "scores.json").read_text())
    shape, measured, pose = scores["topology"], scores["measured"], scores["pose2_error"]
    what = f"{name} seed {seed}"
    right = shape["components"] == 1 and shape["watertight"] and shape["genus"] == shape["true_genus"]
    bench.line(f"{what}: topology", "1 component, watertight, genus of the truth",
               f"{shape['components']} component, {'watertight' if shape['watertight'] else 'open'}, "
               f"genus {shape['genus']} of {shape['true_genus']}", right)
    bench.at_most(f"{what}: measured area, median", 0.04, measured["median_mm"], "mm", 4)
    bench.at_most(f"{what}: measured area, p95", 0.2, measured["p95_mm"], "mm", 4)
    bench.at_least(f"{what}: observable truth within 0.15 mm", 95, 100 * scores["covered_0.15_mm"], "%")
    bench.at_most(f"{what}: measured area further than 0.5 mm off", 1, 100 * measured["share_over_0.50_mm"], "%")
    bench.at_most(f"{what}: pose 2 into pose 1, rotation", 0.1, pose["deg"], "deg", 4)
    bench.at_most(f"{what}: pose 2 into pose 1, translation", 0.1, pose["mm"], "mm", 4)
    bench.at_most(f"{what}: texture, median patch offset", 1, scores["texture"]["median_px"], "px")


def models(bench, _scratch):
    for name, options in objects(bench):
        for seed in SEEDS[:bench.pick(full=3, sampled=1, quick=1)]:
            if options is None:
                bench.line(f"{name} seed {seed}", "a model within the limits", "not measured: no data", None)
                continue
            folder = bench.out / f"{name}_{seed}"
            is_plain = name == "figurine" and seed == 1  # as a person calls it
            done, seconds = demo(bench, folder, [*options, "--seed", seed], "own" if is_plain else "true")
            if is_plain:
                demo_itself(bench, folder, done, seconds)
            if not (folder / "scores.json").is_file():
                bench.line(f"{name} seed {seed}", "a model within the limits", f"none: {done.stderr.strip()}", False)
                continue
            accuracy(bench, name, seed, folder)


def render_time(bench, _scratch):
    if bench.cores < 2:
        bench.line("a rendered view (four images) on 2 cores", "<= 4 s", "not measured: 1 core", None)
        return
    seconds = {}
    for views in (1, 5):
        folder = bench.out / "render"
        shutil.rmtree(folder, ignore_errors=True)
        began = time.monotonic()
        bench.run(two_cores([bench.bin / "scanrig-sim", "shoot", "--out", folder, "--views", views]), 300, check=True)
        seconds[views] = time.monotonic() - began
        shutil.rmtree(folder)
    # two poses: 8 views more in the second run than in the first
    bench.at_most("a rendered view (four images) on 2 cores", 4, (seconds[5] - seconds[1]) / 8, "s")


def from_nothing(bench, _scratch):
    what = "a bare Debian 12 on 2 cores"
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(f"{what}: from nothing to the demo's model", "<= 10 min", reason, None)
        bench.line(f"{what}: of which the build", "<= 6 min", reason, None)
        return
    with bare_machine.bare_machine("bookworm") as root:
        tree = bare_machine.clone_into(ROOT, root)
        done, seconds = bare_machine.run_inside(root, "cd /scanrig && ./dev demo", 3600)
        if done.returncode != 0:
            bench.line(f"{what}: from nothing to the demo's model", "<= 10 min", done.stderr[-300:], False)
            return
        bench.at_most(f"{what}: from nothing to the demo's model", 10, seconds / 60, "min", 1)
        bench.at_most(f"{what}: of which the build", 6, bare_machine.build_seconds(tree / "build/release") / 60, "min", 1)


def each_case(bench, what, cases):
    for name, ok, measured in cases:
        bench.line(f"{what}: {name}", "as documented", measured, ok)


def killed_scans(bench, scratch):
    kills = bench.pick(full=20, sampled=8, quick=3)
    each_case(bench, "SIGKILL in a scan", bench.in_time(sigkill.cases(bench.bin, scratch, kills)))


PARTS = {"models": models,
         "render": render_time,
         "same_model": lambda bench, scratch: each_case(bench, "same model", truth_absent.cases(bench.bin, scratch)),
         "dragon": lambda bench, _: dragon.measure(bench),
         "rim": lambda bench, _: d415_pair.measure(bench),
         "bad_input": lambda bench, scratch: each_case(bench, "bad input", bad_input.cases(
             bench.bin, scratch, ROOT / "config" / "rigs" / "example.toml")),
         "sigkill": killed_scans,
         "bare_machine": from_nothing}
