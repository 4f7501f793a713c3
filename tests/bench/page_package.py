"""The Debian packages on a bare machine: installed, verified, scanned with, upgraded, downgraded, removed, purged.

With --long on Debian 13 too, and built twice.
"""
import hashlib
import os
import pathlib
import re
import shutil
import subprocess

import bare_machine
import debian13

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUILT = "./dev package, lintian without errors"
HIGHER = "99.0.0"
BUILD_S, INSTALL_S, ROWS_S = 5400, 1200, 1800
LOOPBACK = "scanrig-sim own-network --"


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def build(bench, command, folder):
    """Packages that `command` has made in `folder`; none after a line that gives the reason."""
    done = bench.run(command, BUILD_S)
    packages = sorted(folder.glob("*.deb")) if done.returncode == 0 else []
    sizes = ", ".join(f"{package.name} {package.stat().st_size / 1e6:.1f} MB" for package in packages)
    bench.line(BUILT, "built", sizes or (done.stdout + done.stderr).strip()[-300:], bool(packages))
    return packages


def higher(package, folder):
    """The same package with a higher version, as a new file in `folder`."""
    tree = folder / "tree"
    subprocess.run(["dpkg-deb", "-R", package, tree], check=True)
    version = output("dpkg-deb", "-f", package, "Version")
    for file in (tree / "DEBIAN" / "control", tree / "DEBIAN" / "preinst"):
        if file.exists():
            file.write_text(file.read_text().replace(version, HIGHER))
    output("dpkg-deb", "--root-owner-group", "-Znone", "-b", tree, folder)
    shutil.rmtree(tree)


def lay_out(packages, folder):
    """old/, new/ and the scenario, for the machine."""
    for name in ("old", "new"):
        (folder / name).mkdir(parents=True)
    for package in packages:
        shutil.copy(package, folder / "old")
        higher(package, folder / "new")
    shutil.copy(ROOT / "tests" / "package" / "scenario.sh", folder)


def rows(bench, suite, printed):
    """One line per row that the scenario has printed."""
    for verdict, what, figure in re.findall(r"^(ok|NO) ([^|\n]+) \| (.*)$", printed, re.MULTILINE):
        bench.line(f"packages, {suite}: {what}", "yes", figure.strip(), verdict == "ok")


def on_machine(bench, suite, packages, scratch):
    folder = scratch / suite
    lay_out(packages, folder)
    with bare_machine.bare_machine(suite) as root:
        shutil.copytree(folder, root / "packages")
        os.chmod(root / "packages", 0o755)
        done, seconds = bare_machine.run_inside(root, "sh /packages/scenario.sh install /packages", INSTALL_S)
        rows(bench, suite, done.stdout)
        bench.line(f"packages, {suite}: time to install, with dependencies", "reported", f"{seconds:.0f} s", True)
        done, _ = bare_machine.run_inside(root, f"{LOOPBACK} sh /packages/scenario.sh rows /packages", ROWS_S)
        rows(bench, suite, done.stdout)
        ended = done.returncode == 0
        bench.line(f"packages, {suite}: all rows", "run", "run" if ended else done.stderr.strip()[-300:], ended)


def same_bytes(bench, packages, scratch):
    """The same commit, built once more in another folder."""
    tree = scratch / "again"
    subprocess.run(["git", "clone", "-q", ROOT, tree], check=True)
    again = build(bench, [tree / "dev", "package"], tree / "out" / "package")
    sums = [[hashlib.sha256(package.read_bytes()).hexdigest() for package in some] for some in (packages, again)]
    same = sums[0] == sums[1]
    bench.line("packages: built twice, in two folders", "the same bytes", "the same" if same else "different", same)


def measure(bench, scratch):
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(BUILT, "built", reason, None)
        return
    if packages := build(bench, [ROOT / "dev", "package"], ROOT / "out" / "package"):
        on_machine(bench, "bookworm", packages, scratch)
    if bench.long:
        same_bytes(bench, packages, scratch)
        committed = output("git", "-C", ROOT, "log", "-1", "--format=%ct")
        inside = debian13.shell(f"SOURCE_DATE_EPOCH={committed} ./dev package")
        if packages := build(bench, inside, debian13.KEPT / "out" / "package"):
            on_machine(bench, "trixie", packages, scratch)
