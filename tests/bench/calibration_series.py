"""Board images of drawn rigs, and the calibrations that the shipped program makes of them."""
import hashlib
import json
import shutil
import subprocess
import time

LIMIT_S = 600
NOISE = ["--rig", "noise=1"]
RIM_DOTS = ["--rim-dots", "40x84.5x2.4"]


def shoot(bench, folder, seed, options):
    shutil.rmtree(folder, ignore_errors=True)
    bench.run([bench.bin / "scanrig-sim", "shoot-board", "--out", folder, "--rig-seed", seed, "--seed", seed, *options],
              LIMIT_S, check=True)


def calibrate(bench, folder, options):
    return bench.run([bench.bin / "scanrig", "calibrate", folder, "--json", "--out", folder / "calibration.json",
                      "--no-report", *options], LIMIT_S)


def error_of(bench, folder, seed, changes=""):
    """Of the working volume against the truth: rms_um, max_um, scale_ppm, predicted_um."""
    command = [bench.bin / "calibration_error", folder / "calibration.json", seed]
    return json.loads(bench.run([*command, changes] if changes else command, LIMIT_S, check=True).stdout)


def replace_calibration(scan, calibration):
    """Of a scan folder, as if the rig had had this one."""
    text = calibration.read_bytes()
    (scan / "calibration.json").write_bytes(text)
    manifest = json.loads((scan / "scan.json").read_text())
    manifest["calibration"]["sha256"] = hashlib.sha256(text).hexdigest()
    (scan / "scan.json").write_text(json.dumps(manifest, indent=2))


def start_rig(bench, folder, socket, jobs):
    """A simulated rig that has no calibration yet, ready."""
    log = (folder / "daemon.log").open("w")
    daemon = subprocess.Popen([bench.bin / "scanrigd-sim", "--socket", socket, "--jobs", jobs, "--rig-seed", "3",
                               "--rig", "noise=1", "--operator", "helper"], stdout=log, stderr=log)
    for _ in range(300):
        status = bench.run([bench.bin / "scanrig", "status", "--socket", socket], 20)
        if "Operational.Ready" in status.stdout:
            return daemon
        time.sleep(0.2)
    daemon.kill()
    raise RuntimeError(f"the rig is not ready: {status.stdout}{status.stderr}")


def remove(folder):
    shutil.rmtree(folder, ignore_errors=True)
