"""A bare Debian in a folder, and commands of the project that run there."""
import contextlib
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import time

CORES = "0,1"


def archive():
    """Debian archive that this machine is installed from, or None."""
    form = "$(REPO_URI) $(LABEL)"
    try:
        answer = subprocess.run(["apt-get", "indextargets", "--format", form], capture_output=True, text=True)
    except FileNotFoundError:
        return None
    for line in answer.stdout.splitlines():
        address, _, label = line.partition(" ")
        if label == "Debian":
            return address
    return None


def why_not():
    """Sentence that gives the reason why this machine cannot make one, else None."""
    if os.geteuid() != 0:
        return "not measured: making a bare machine wants root"
    if not shutil.which("mmdebstrap"):
        return "not measured: mmdebstrap is not installed"
    if len(os.sched_getaffinity(0)) < 2:
        return "not measured: fewer than 2 cores"
    return None if archive() else "not measured: no Debian archive is configured here"


def make(suite, root, packages=()):
    """Makes a machine with nothing but essential packages, apt and `packages`."""
    more = [f"--include={','.join(packages)}"] if packages else []
    subprocess.run(["mmdebstrap", "--quiet", "--variant=minbase", *more, suite, root, archive()], check=True, timeout=600)
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")


@contextlib.contextmanager
def bare_machine(suite, packages=()):
    """Root folder of a bare machine with `packages`; removed afterwards."""
    root = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-bare-"))
    try:
        make(suite, root, packages)
        yield root
    finally:
        shutil.rmtree(root)


def entrance(root, command, binds=()):
    """Command line that runs `command` (a shell line) inside `root` with its own /proc and /dev.
    `binds`: pairs of a folder here and its place inside. Every mount ends with the command."""
    mounts = [f"mount -t proc proc {root}/proc", f"mount --rbind /dev {root}/dev"]
    for source, target in binds:
        inside = shlex.quote(f"{root}/{target}")
        mounts.append(f"mkdir -p {inside} && mount --bind {shlex.quote(str(source))} {inside}")
    enter = (f"exec chroot {root} /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 "
             f"sh -c {shlex.quote(command)}")
    return ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", " && ".join([*mounts, enter])]


def run_inside(root, command, timeout):
    """Runs `command` (a shell line) inside, on two cores. Returns (process, seconds)."""
    began = time.monotonic()
    done = subprocess.run(["taskset", "-c", CORES, *entrance(root, command)], capture_output=True, text=True,
                          timeout=timeout)
    return done, time.monotonic() - began


def build_seconds(tree):
    """Time from the first compile's start to the last one's end, as ninja logged it."""
    spans = [line.split("\t")[:2] for line in (tree / ".ninja_log").read_text().splitlines() if line[:1].isdigit()]
    return (max(int(end) for _, end in spans) - min(int(start) for start, _ in spans)) / 1000


def clone_into(source, root):
    subprocess.run(["git", "clone", "-q", source, root / "scanrig"], check=True)
    return root / "scanrig"
