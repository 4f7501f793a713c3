#!/usr/bin/env python3
"""./dev debian13 [CTEST OPTIONS]: builds this tree and runs its tests on a bare Debian 13, kept in build/debian13."""
import shlex
import subprocess
import sys

import bare_machine
from kept_machine import KeptMachine

MACHINE = KeptMachine("debian13", "trixie")
KEPT = MACHINE.folder


def shell(line):
    """Command line that runs a shell line in this tree inside."""
    return MACHINE.shell(line)


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
