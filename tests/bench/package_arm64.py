#!/usr/bin/env python3
"""./dev package arm64: builds the packages for ARM64 on a bare Debian 12, kept in build/arm64, by a cross compiler.

As a part of the bench also the unit tests, in an emulator of that processor.
"""
import shutil
import subprocess
import sys

import bare_machine
from kept_machine import ROOT, KeptMachine

MACHINE = KeptMachine("arm64", "bookworm")
PACKED = MACHINE.folder / "out" / "package"
BUILT, TESTED = "./dev package arm64, lintian without errors", "unit tests of ARM64, in an emulator"
BUILD_S, TESTS_S = 7200, 7200
# Tests by name: others of that label are checks of the tree.
TESTS = ("cmake --preset package -DSCANRIG_TESTS=ON >/dev/null && "
         "names=$(ctest --test-dir build/package -N -L unit | sed -n 's/^ *Test *#[0-9]*: \\(.*_test\\)$/\\1/p') && "
         "built=$(for name in $names; do ninja -C build/package -t query $name >/dev/null 2>&1 && echo $name; done) && "
         "cmake --build build/package --target $built >/dev/null && "
         "ctest --test-dir build/package -L unit -R \"^($(echo $built | tr ' ' '|'))$\"")


def committed_s():
    log = subprocess.run(["git", "-C", ROOT, "log", "-1", "--format=%ct"], capture_output=True, text=True, check=True)
    return log.stdout.strip()


def command():
    """Command line that builds the packages, the page being built in out/web already."""
    page = MACHINE.folder / "out" / "web"
    shutil.rmtree(page, ignore_errors=True)
    page.parent.mkdir(parents=True, exist_ok=True)
    shutil.copytree(ROOT / "out" / "web", page)
    return MACHINE.shell(f"SOURCE_DATE_EPOCH={committed_s()} SCANRIG_CROSS=arm64 ./dev package")


def measure(bench, _):
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(BUILT, "built", reason, None)
        return
    done = bench.run([ROOT / "dev", "package", "arm64"], BUILD_S)
    packages = sorted((ROOT / "out" / "package-arm64").glob("*_arm64.deb")) if done.returncode == 0 else []
    sizes = ", ".join(f"{package.name} {package.stat().st_size / 1e6:.1f} MB" for package in packages)
    bench.line(BUILT, "built", sizes or (done.stdout + done.stderr).strip()[-300:], bool(packages))
    if packages:
        tests = bench.run(MACHINE.shell(TESTS), TESTS_S)
        told = [line for line in tests.stdout.splitlines() if "tests passed" in line]
        bench.line(TESTED, "all pass", told[0] if told else tests.stdout[-300:] + tests.stderr[-300:], tests.returncode == 0)


def main():
    if reason := bare_machine.why_not():
        print(f"dev package arm64: {reason}", file=sys.stderr)
        return 77
    code = subprocess.run(command()).returncode
    if code == 0:
        shutil.rmtree(ROOT / "out" / "package-arm64", ignore_errors=True)
        shutil.copytree(PACKED, ROOT / "out" / "package-arm64")
    return code


if __name__ == "__main__":
    sys.exit(main())
