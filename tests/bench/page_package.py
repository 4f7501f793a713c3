"""The Debian packages where systemd runs: Debian 12 and 13 in the virtual machine, from the installation to the purge.

With --long also built twice.
"""
import concurrent.futures
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import time

import bare_machine
import debian13

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
for folder in ("hil", "package"):
    sys.path.append(str(ROOT / "tests" / folder))
import image  # noqa: E402
import machine  # noqa: E402
import package_machine  # noqa: E402
import package_rows  # noqa: E402
import station  # noqa: E402
import stepped_block  # noqa: E402

BUILT = "./dev package, lintian without errors"
HIGHER = "99.0.0"
LIMIT_MIN = 8
BUILD_S = 5400


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def build(bench, what, command, folder, **options):
    """Packages that `command` has made in `folder`; none after a line that gives the reason."""
    done = bench.run(command, BUILD_S, **options)
    packages = sorted(folder.glob("*.deb")) if done.returncode == 0 else []
    sizes = ", ".join(f"{package.name} {package.stat().st_size / 1e6:.1f} MB" for package in packages)
    bench.line(f"{BUILT}: {what}", "built", sizes or (done.stdout + done.stderr).strip()[-300:], bool(packages))
    return packages


def build_here(bench):
    return build(bench, "Debian 12", [ROOT / "dev", "package"], ROOT / "out" / "package")


def higher(package, folder):
    """The same package with a higher version, as a new file in `folder`."""
    tree = folder / "tree"
    subprocess.run(["dpkg-deb", "-R", package, tree], check=True)
    version = output("dpkg-deb", "-f", package, "Version")
    for file in (tree / "DEBIAN" / "control", tree / "DEBIAN" / "preinst"):
        if file.exists():
            file.write_text(file.read_text().replace(version, HIGHER))
    output("dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "-b", tree, folder)
    shutil.rmtree(tree)


def lay_out(packages, folder):
    """old/, new/ and a part to scan, for the machine."""
    for name in ("old", "new"):
        (folder / name).mkdir(parents=True)
    for package in packages:
        shutil.copy(package, folder / "old")
        higher(package, folder / "new")
    stepped_block.write(folder / "part.obj")


def journal(booted):
    """The last lines of both services, for a row that fell short."""
    try:
        return booted.call("journalctl --no-pager -o cat -u 'scanrigd*' -n 8")[1]
    except machine.Gone as problem:
        return str(problem)


class Suite:
    """One Debian: its machine, and its lines, which are printed when all have ended."""

    def __init__(self, name, packages, folder):
        self.name = name
        self.packages = packages
        self.folder = folder
        self.lines = []

    def line(self, what, asked, measured, ok):
        self.lines.append((f"packages, {self.name}: {what}", asked, measured, ok))

    def run(self, cached, system):
        self.folder.mkdir(parents=True)
        lay_out(self.packages, self.folder / "packages")
        disk = self.folder / "base.sqfs"
        bare = package_machine.make_disk(self.name, self.packages, disk)
        self.line("apt on a bare machine, with all dependencies", "installed", f"{bare.output} in {bare.seconds:.0f} s",
                  bare.ok)
        self.line("purged there", "nothing left", " ".join(bare.left) or "nothing", not bare.left)
        if bare.ok:
            self.rows(package_machine.boot(self.folder, package_machine.lay_out(cached, system, disk, self.folder),
                                           self.folder / "packages"))

    def rows(self, booted):
        with booted:
            for what, asked, act in package_rows.ROWS:
                begun = time.monotonic()
                try:
                    measured, ok = act(booted), True
                except (station.Unmet, machine.Gone, RuntimeError) as problem:
                    measured, ok = f"{problem}; {journal(booted)}", False
                self.line(what, asked, f"{measured} [{time.monotonic() - begun:.0f} s]", ok)

    def attempt(self, cached, system):
        try:
            self.run(cached, system)
        except (machine.Gone, RuntimeError, OSError, subprocess.SubprocessError) as problem:
            self.line("its machine", "runs to its end", str(problem), False)


def in_machines(bench, suites):
    """All at once, a core each. The kernel, the bare Debians and what makes them test machines were made before."""
    for suite in suites:
        package_machine.bare_debian(suite.name)
    cached, _ = image.prepare(ROOT / "build" / "hil", [bench.bin / name for name in station.PROGRAMS])
    system, _ = image.prepare_system(cached)
    begun = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor() as pool:
        list(pool.map(lambda suite: suite.attempt(cached, system), suites))
    took = (time.monotonic() - begun) / 60
    for line in (line for suite in suites for line in suite.lines):
        bench.line(*line)
    bench.at_most(f"packages: {' and '.join(suite.name for suite in suites)}, together", LIMIT_MIN, took, "min", digits=1)


def command_of_13():
    """The page is the one that Debian 12 has built: the bare machine does not know this machine's npm registry."""
    shutil.copytree(ROOT / "build" / "package" / "page", debian13.KEPT / "out" / "page", dirs_exist_ok=True)
    committed = output("git", "-C", ROOT, "log", "-1", "--format=%ct")
    return debian13.shell(f"SOURCE_DATE_EPOCH={committed} ./dev package -DSCANRIG_WEB_DIST=/scanrig/out/page")


def same_bytes(bench, packages, scratch):
    """The same commit, compiled once more in another folder."""
    tree = scratch / "again"
    subprocess.run(["git", "clone", "-q", ROOT, tree], check=True)
    again = build(bench, "in another folder", [tree / "dev", "package"], tree / "out" / "package",
                  env={**os.environ, "CCACHE_DISABLE": "1"})
    sums = [[hashlib.sha256(package.read_bytes()).hexdigest() for package in some] for some in (packages, again)]
    same = sums[0] == sums[1]
    bench.line("packages: built twice, in two folders", "the same bytes", "the same" if same else "different", same)


def measure(bench, scratch):
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(BUILT, "built", reason, None)
        return
    bench.run([ROOT / "dev", "deps", "hil"], BUILD_S, check=True)
    made = {"bookworm": build_here(bench)}
    if made["bookworm"]:
        made["trixie"] = build(bench, "Debian 13", command_of_13(), debian13.KEPT / "out" / "package")
    in_machines(bench, [Suite(name, packages, scratch / name) for name, packages in made.items() if packages])
    if bench.long and made["bookworm"]:
        same_bytes(bench, made["bookworm"], scratch)
