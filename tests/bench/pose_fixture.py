"""Objects on putty and on pins: rendered, reconstructed with the key and without it, compared with the object alone."""
import shutil

import hollow_objects
import pose_many
import real_rig_scans

SCALE, HEIGHT_MM, OBJECTS = 0.5, 80, 10
MAX_DEG, MAX_CLAIMS = 0.3, 0.002  # of pose 2; share of measured area that is not the object's: gate C


def shoot(bench, scan, file, kind, seed):
    shutil.rmtree(scan, ignore_errors=True)
    ran = bench.run([bench.bin / "scanrig-sim", "shoot", "--out", scan, "--object", file, "--height-mm", HEIGHT_MM,
                     "--scale", SCALE, "--seed", seed, "--fixture", kind], 900)
    return ran.returncode == 0, ran.stderr.strip()[-200:]


def figures_of(bench, scan, options):
    model = scan / "model"
    report, why = real_rig_scans.reconstruct(bench, scan, model, *options)
    if not report:
        return None, why
    scores = real_rig_scans.evaluate(bench, scan, model)
    error = pose_many.pose_errors(bench, scan, model)[0]
    return {"deg": error["deg"], "mm": error["mm"], "claims": scores["measured"]["share_over_0.25_mm"], "fixtures": len(report["fixtures"])}, ""


def measure(bench, scratch):
    folder = scratch / "fixtures"
    folder.mkdir(parents=True, exist_ok=True)
    objects = hollow_objects.all_objects(folder)[::2][:bench.pick(OBJECTS, OBJECTS, 2)]
    for options, how in (((["--fixture"]), "with the key"), ([], "without the key")):
        done = []
        for number, (name, file) in enumerate(objects):
            kind, scan = ("putty", "pins")[number % 2], folder / name.replace(" ", "_")
            is_shot, why = (True, "") if scan.exists() else shoot(bench, scan, file, kind, number + 1)
            figures, why = figures_of(bench, scan, options) if is_shot else (None, why)
            bench.note(f"{how}: {name} on {kind}: {figures or why}")
            if figures:
                done.append(figures)
        bench.line(f"{how}: pose within {MAX_DEG} deg", f"{len(objects)} of {len(objects)}",
                   f"{sum(1 for f in done if f['deg'] <= MAX_DEG)} of {len(objects)}",
                   len(done) == len(objects) and all(f["deg"] <= MAX_DEG for f in done))
        bench.line(f"{how}: a fixture is found in both poses", f"{len(objects)} of {len(objects)}",
                   f"{sum(1 for f in done if f['fixtures'] == 2)} of {len(objects)}",
                   len(done) == len(objects) and all(f["fixtures"] == 2 for f in done))
        bench.at_most(f"{how}: measured area that is not the object's, worst", MAX_CLAIMS,
                      max((f["claims"] for f in done), default=None), "", 5)
