"""The calibration that the demo's rig makes itself, once: kept under out/calibration until the simulator changes."""
import hashlib
import json
import os
import pathlib
import shutil
import subprocess

KEPT = pathlib.Path("out/calibration")
LIMIT_S = 1800
CALIBRATION, REPORT = "calibration.json", "calibration.html"


def own_calibration(options, start_rig, log):
    """The folder with calibration.json and calibration.html. `start_rig(folder)` gives an uncalibrated rig that responds.

    Raises RuntimeError.
    """
    simulator = hashlib.sha256((options.bin / "scanrig-sim").read_bytes()).hexdigest()[:12]
    kept = KEPT / f"{simulator}-{options.profile}-{options.scale:g}"
    if (kept / CALIBRATION).is_file():
        print(f"Calibration  {kept}/{CALIBRATION}, made by this rig before", flush=True)
        return kept
    print("The rig calibrates itself: a simulated operator puts the board in seven places (once, about two minutes)", flush=True)
    working = KEPT / "working"
    shutil.rmtree(working, ignore_errors=True)
    working.mkdir(parents=True)
    rig = start_rig(working)
    try:
        client = [options.bin / "scanrig", "calibrate", "--socket", rig.socket]
        for step in (["--rig"], ["--accept"]):
            done = subprocess.run([*client, *step], stdout=log, stderr=subprocess.PIPE, text=True, timeout=LIMIT_S)
            if done.returncode != 0:
                raise RuntimeError(f"the calibration failed: {done.stderr.strip()}; see {working}")
    finally:
        rig.stop()
    job = max((p for p in rig.jobs.iterdir() if p.is_dir() and (p / "scan.json").is_file()), key=lambda p: p.name)
    made = KEPT / "made"
    shutil.rmtree(made, ignore_errors=True)
    made.mkdir()
    shutil.copy(rig.jobs / CALIBRATION, made)
    shutil.copy(job / REPORT, made)
    shutil.rmtree(kept, ignore_errors=True)
    made.rename(kept)
    shutil.rmtree(working)
    print(f"Calibration  {kept}/{CALIBRATION}, grade {json.loads((kept / CALIBRATION).read_text())['grade']}; "
          f"report {kept}/{REPORT}", flush=True)
    return kept


def with_true_calibration(scan, folder):
    """The scan once more in `folder`, as if its rig had known the truth."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(scan, folder, copy_function=os.link, ignore=shutil.ignore_patterns("model"))
    text = (scan / "truth_calibration.json").read_bytes()
    manifest = json.loads((scan / "scan.json").read_text())
    manifest["calibration"]["sha256"] = hashlib.sha256(text).hexdigest()
    for name, content in ((CALIBRATION, text), ("scan.json", json.dumps(manifest, indent=2).encode())):
        (folder / name).unlink()  # a link: the scan's own file stays as it is
        (folder / name).write_bytes(content)
