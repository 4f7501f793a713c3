"""The same board images calibrated on Debian 12 (OpenCV 4.6) and on a bare Debian 13 (OpenCV 4.10): the same figures."""
import json
import shutil

import bare_machine
import calibration_series
import debian13

WHAT, LIMIT_UM = "Debian 13 against Debian 12: calibration of the same images", 0.1
BUILD_S = 5400
CORNER_TESTS = ("calibration_board_test", "calibration_corners_test")


def measure(bench, scratch):
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(WHAT, f"<= {LIMIT_UM} um", reason, None)
        return
    folder = scratch / "boards"
    calibration_series.shoot(bench, folder, 1, [*calibration_series.NOISE, "--scale", "0.5"])
    calibration_series.calibrate(bench, folder, calibration_series.RIM_DOTS).check_returncode()
    shared = debian13.KEPT / "out" / "boards"  # out/boards inside
    shutil.rmtree(shared, ignore_errors=True)
    shutil.copytree(folder, shared)
    (shared / "calibration.json").unlink()
    calibrate = ["build/release/bin/scanrig", "calibrate", "out/boards", "--out", "out/boards/calibration.json",
                 "--no-report", *calibration_series.RIM_DOTS]
    targets = " ".join(("scanrig", *CORNER_TESTS))
    tests = " && ".join(f"build/release/bin/{test}" for test in CORNER_TESTS)
    done = bench.run(debian13.shell(f"./dev deps test && cmake --preset release -DSCANRIG_TESTS=ON -DSCANRIG_BENCH=ON && "
                                    f"cmake --build --preset release --target {targets} && {' '.join(calibrate)}; "
                                    f"calibrated=$?; {tests} && exit $calibrated"), BUILD_S)
    bench.line("corners and boards with the OpenCV of Debian 13: their tests", "all pass",
               "pass" if done.returncode == 0 else done.stdout.strip().splitlines()[-1], done.returncode == 0)
    if not (shared / "calibration.json").is_file():
        bench.line(WHAT, f"<= {LIMIT_UM} um", done.stderr.strip()[-300:], False)
        return
    command = [bench.bin / "calibration_error", folder / "calibration.json", shared / "calibration.json"]
    difference = json.loads(bench.run(command, 60, check=True).stdout)["difference_um"]
    bench.at_most(WHAT, LIMIT_UM, difference, "um")
