#!/usr/bin/env python3
"""The one place where figures are made: ./dev bench GROUP... [--quick] [--only PART...] [--record]

Every group is a module beside this file with `measure(bench)`; it calls bench.line() for each figure that an issue or a
design page asks for. A group with PARTS can be measured in parts: it asks bench.wants() before each. Prints what | asked | measured | ok, writes out/bench.json, exits 1 when a line falls short.
A line that this machine cannot measure says so and does not count as held.
"""
import argparse
import importlib
import json
import os
import pathlib
import subprocess
import sys

import record as record_file

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent


class Bench:
    def __init__(self, binaries, quick):
        self.bin = pathlib.Path(binaries).resolve()
        self.quick = quick
        self.only = set()
        self.out = ROOT / "out" / "bench"
        self.out.mkdir(parents=True, exist_ok=True)
        self.cores = len(os.sched_getaffinity(0))
        self.group = ""
        self.lines = []
        self.profile = ""

    @property
    def data(self):
        """Real captures beside the project, or None."""
        path = pathlib.Path(os.environ.get("SCANRIG_SHARED_DATA", ROOT.parent / "shared" / "data"))
        return path if path.is_dir() else None

    def wants(self, part):
        return not self.only or part in self.only

    def line(self, what, asked, measured, ok):
        """`ok` is True, False or None (not measured; `measured` says why)."""
        self.lines.append({"group": self.group, "what": what, "asked": asked, "measured": measured, "ok": ok})
        print(f"{what} | {asked} | {measured} | {'-' if ok is None else 'ok' if ok else 'NO'}", flush=True)

    def at_most(self, what, limit, value, unit="", digits=3):
        if value is None:
            self.line(what, f"<= {limit} {unit}".strip(), "not measured", None)
        else:
            self.line(what, f"<= {limit} {unit}".strip(), f"{value:.{digits}f} {unit}".strip(), value <= limit)

    def at_least(self, what, limit, value, unit="", digits=2):
        if value is None:
            self.line(what, f">= {limit} {unit}".strip(), "not measured", None)
        else:
            self.line(what, f">= {limit} {unit}".strip(), f"{value:.{digits}f} {unit}".strip(), value >= limit)

    def note(self, text):
        print(f"   {text}", flush=True)

    def run(self, command, timeout, **options):
        """A finished process with its text output; a hang ends as exit code 124."""
        command = [str(word) for word in command]
        try:
            return subprocess.run(command, capture_output=True, text=True, timeout=timeout, **options)
        except subprocess.TimeoutExpired as late:
            return subprocess.CompletedProcess(command, 124, str(late.stdout or ""), f"still running after {timeout} s")


def commit():
    """What is measured; the tables of an earlier part, not yet committed, change nothing about it."""
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    dirty = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/measured.md")
    return git("describe", "--always") + ("-dirty" if dirty else "")


def main():
    groups = sorted(p.stem[len("group_"):] for p in HERE.glob("group_*.py"))
    parser = argparse.ArgumentParser(prog="./dev bench", description=__doc__.splitlines()[0])
    parser.add_argument("groups", nargs="+", choices=groups, metavar="GROUP", help=f"one of: {', '.join(groups)}")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions; for a first look, not for the record")
    parser.add_argument("--only", nargs="+", metavar="PART", default=[], help="parts of the group; --record then puts "
                        "their lines into the table that is there, and says so")
    parser.add_argument("--record", action="store_true", help="put the full table into docs/measured.md")
    parser.add_argument("--bin", required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.record and options.quick:
        parser.error("--record wants the full measurement, not --quick")

    sys.path.insert(0, str(HERE))
    modules = {group: importlib.import_module(f"group_{group}") for group in options.groups}
    known = [part for module in modules.values() for part in getattr(module, "PARTS", ())]
    if unknown := set(options.only) - set(known):
        parser.error(f"no such part: {', '.join(sorted(unknown))}; there are: {', '.join(known) or 'none'}")

    bench = Bench(options.bin, options.quick)
    bench.only = set(options.only)
    measured_commit = commit()
    print(f"commit {measured_commit}, {bench.cores} cores{', quick' if options.quick else ''}")
    print("what | asked | measured | ok")
    for group, module in modules.items():
        bench.group = group
        module.measure(bench)

    held = [line["ok"] for line in bench.lines]
    print(f"profile {bench.profile or '-'}")
    print(f"{held.count(True)} held, {held.count(False)} fell short, {held.count(None)} not measured")
    record = {"commit": measured_commit, "cores": bench.cores, "quick": options.quick, "profile": bench.profile,
              "lines": bench.lines}
    (ROOT / "out" / "bench.json").write_text(json.dumps(record, indent=1) + "\n")
    if options.record:
        record_file.write(ROOT / "docs" / "measured.md", options.groups, record, again=bool(options.only))
    return 1 if False in held else 0


if __name__ == "__main__":
    sys.exit(main())
