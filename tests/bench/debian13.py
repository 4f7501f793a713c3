#!/usr/bin/env python3
"""./dev debian13 [CTEST OPTIONS]: builds this tree and runs its tests on a bare Debian 13.

The machine is kept in build/debian13 with its packages, compiler cache and build, so that a second run is quick.
"""
import os
import pathlib
import shlex
import shutil
import subprocess
import sys

import bare_machine

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
KEPT = ROOT / "build" / "debian13"


def machine():
    """Root folder of the kept machine."""
    root = KEPT / "root"
    if not root.is_dir():
        making = KEPT / "making"
        shutil.rmtree(making, ignore_errors=True)
        making.parent.mkdir(parents=True, exist_ok=True)
        bare_machine.make("trixie", making)
        making.rename(root)
    return root


def shell(line):
    """Command line that runs a shell line in this tree inside; its build/ and out/ are separate."""
    binds = [(ROOT, "scanrig")]
    for folder in ("build", "out"):
        (KEPT / folder).mkdir(parents=True, exist_ok=True)
        (ROOT / folder).mkdir(exist_ok=True)
        binds.append((KEPT / folder, f"scanrig/{folder}"))
    data = pathlib.Path(os.environ.get("SCANRIG_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if data.is_dir():
        binds.append((data, "shared/data"))
    return bare_machine.entrance(machine(), f"cd /scanrig && export SCANRIG_SHARED_DATA=/shared/data; {line}", binds)


def command(verb):
    """The same for `./dev VERB...`."""
    return shell(f"./dev {shlex.join(verb)}")


def main():
    reason = bare_machine.why_not()
    if reason:
        print(f"dev debian13: {reason}", file=sys.stderr)
        return 77
    return subprocess.run(command(["test", *sys.argv[1:]])).returncode


if __name__ == "__main__":
    sys.exit(main())
