#!/usr/bin/env python3
"""The one program that makes figures: ./dev bench GROUP... [--long] [--quick] [--only PART...] [--record]
    [--compare FILE]

Every group is a module beside this file with PARTS, the functions that measure its parts. Each calls bench.line() for
each figure that an issue or a design page requires. Without --long a part takes samples and ends within its budget
(budget.py), so that a group ends within 45 minutes on two cores. Prints what | asked | measured | ok, writes
out/bench.json, exits 1 when a line does not hold. A line that this machine cannot measure does not count as held.
"""
import argparse
import importlib
import json
import os
import pathlib
import subprocess
import sys
import time

import budget
import compare
import parts
import record as record_file

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
TEST_BUILD_LIMIT_S = 900
OLD_NAMES = {"road": "end-to-end"}  # old name, accepted for a release


class Bench:
    """`quick`: for a first look; `is_long`: everything; neither: samples, within the budgets."""

    def __init__(self, binaries, quick=False, is_long=False):
        self.bin = pathlib.Path(binaries).resolve()
        self.quick = quick
        self.long = is_long
        self.deadline = None
        self.only = set()
        self.out = ROOT / "out" / "bench"
        self.out.mkdir(parents=True, exist_ok=True)
        self.cores = len(os.sched_getaffinity(0))
        self.group = ""
        self.lines = []
        self.made = set()  # folders of bench.out that this run has made, for the parts that follow
        self.measured = {}  # figures of this run that several parts need
        self.profile = ""
        self.earlier = None  # compare.Earlier

    @property
    def data(self):
        """Real captures beside the project, or None."""
        path = pathlib.Path(os.environ.get("SCANRIG_SHARED_DATA", ROOT.parent / "shared" / "data"))
        return path if path.is_dir() else None

    def wants(self, part):
        return not self.only or part in self.only

    def pick(self, full, sampled, quick):
        """Number of items that this run takes."""
        return quick if self.quick else full if self.long else sampled

    def begin_group(self, group):
        self.group = group
        self.deadline = None if self.long else time.monotonic() + 60 * budget.LIMIT_MIN

    def seconds_left(self):
        """Deadline from the minutes of the group; no deadline with --long."""
        return float("inf") if self.deadline is None else self.deadline - time.monotonic()

    def in_time(self, points):
        """Yields the points, until the minutes of the group are over."""
        for point in points:
            yield point
            if self.seconds_left() <= 0:
                self.note(f"stopped early: the {budget.LIMIT_MIN} minutes of the group are over")
                return

    def line(self, what, asked, measured, ok):
        """`ok` is True, False or None (not measured; `measured` gives the reason)."""
        measured = " ".join(measured.replace(f"{ROOT}/", "").split())  # an error's text: one line, no place of this machine
        self.lines.append({"group": self.group, "what": what, "asked": asked, "measured": measured, "ok": ok})
        beside = f" | {self.earlier.beside(self.lines[-1])}" if self.earlier else ""
        print(f"{what} | {asked} | {measured} | {'-' if ok is None else 'ok' if ok else 'NO'}{beside}", flush=True)

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

    def test_program(self, name):
        """A program of the test suite's own build; built if missing."""
        for command in (["cmake", "--preset", "dev"], ["cmake", "--build", "--preset", "dev", "--target", name]):
            self.run(command, TEST_BUILD_LIMIT_S, cwd=ROOT)
        return ROOT / "build" / "dev" / "bin" / name

    def run(self, command, timeout, **options):
        """A finished process with its text output; a hang ends as exit code 124."""
        command = [str(word) for word in command]
        timeout = max(1.0, min(timeout, self.seconds_left()))
        try:
            return subprocess.run(command, capture_output=True, text=True, timeout=timeout, **options)
        except subprocess.TimeoutExpired as late:
            return subprocess.CompletedProcess(command, 124, str(late.stdout or ""), f"still running after {timeout:.0f} s")


def commit():
    """Commit that is measured; uncommitted tables of an earlier part do not make it dirty."""
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    dirty = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/measured.md")
    return git("describe", "--always") + ("-dirty" if dirty else "")


def group_names():
    return sorted(p.stem[len("group_"):].replace("_", "-") for p in HERE.glob("group_*.py"))


def load(group):
    """Module of a group, its parts checked against the budgets."""
    module = importlib.import_module("group_" + group.replace("-", "_"))
    if problems := budget.problems(group, module.PARTS):
        sys.exit("budget.py: " + "; ".join(problems))
    return module


def arguments():
    groups = group_names()
    parser = argparse.ArgumentParser(prog="./dev bench", description=__doc__.splitlines()[0])
    parser.add_argument("groups", nargs="+", choices=groups, metavar="GROUP", help=f"one of: {', '.join(groups)}",
                        type=lambda name: OLD_NAMES.get(name, name))
    parser.add_argument("--long", action="store_true", help="everything: every call of the kill test, whole soak and "
                        "turns, fuzzing, suites under sanitizers; hours")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions; for a first look, not for the record")
    parser.add_argument("--only", nargs="+", metavar="PART", default=[], help="parts of the group; --record then puts "
                        "their lines into the existing table, each with its commit")
    parser.add_argument("--record", action="store_true", help="put the table into docs/measured.md; lines of --long "
                        "have tables of their own")
    parser.add_argument("--compare", type=pathlib.Path, metavar="FILE", help="an earlier out/bench.json: its values and "
                        "the ratios beside those of this run; exit code 1 when one got worse by more than --tolerance")
    parser.add_argument("--tolerance", type=float, default=20, metavar="PERCENT", help="default: 20")
    parser.add_argument("--bin", required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.record and options.quick:
        parser.error("--record needs the full measurement, not --quick")
    options.groups = list(dict.fromkeys(options.groups))
    options.modules = {group: load(group) for group in options.groups}
    check_only(parser, options)
    options.earlier = earlier_of(parser, options)
    return options


def earlier_of(parser, options):
    """Read before anything runs: the run replaces out/bench.json."""
    if options.compare is None:
        return None
    try:
        return compare.Earlier(options.compare, options.tolerance / 100)
    except (OSError, ValueError, KeyError, TypeError) as error:
        parser.error(f"--compare: {options.compare} is not the bench.json of an earlier run: {error}")


def check_only(parser, options):
    known = [part for module in options.modules.values() for part in module.PARTS]
    if unknown := set(options.only) - set(known):
        parser.error(f"no such part: {', '.join(sorted(unknown))}; possible: {', '.join(known)}")
    runnable = {part for group, module in options.modules.items() for part in module.PARTS
                if budget.runs(group, part, options.long)}
    if left := [part for part in options.only if part not in runnable]:
        parser.error(f"with --long only: {', '.join(left)}")


def main():
    sys.path.insert(0, str(HERE))
    options = arguments()
    bench = Bench(options.bin, options.quick, options.long)
    bench.only = set(options.only)
    bench.earlier = options.earlier
    measured_commit = commit()
    how = "".join(f", {word}" for word in ("long", "quick") if getattr(options, word))
    print(f"commit {measured_commit}, {bench.cores} cores{how}")
    print("what | asked | measured | ok" + (" | earlier, ratio" if bench.earlier else ""))
    for group, module in options.modules.items():
        parts.run_group(bench, group, module)

    held = [line["ok"] for line in bench.lines]
    print(f"profile {bench.profile or '-'}")
    print(f"{held.count(True)} held, {held.count(False)} fell short, {held.count(None)} not measured")
    record = {"commit": measured_commit, "cores": bench.cores, "quick": options.quick, "long": options.long,
              "profile": bench.profile, "lines": bench.lines}
    (ROOT / "out" / "bench.json").write_text(json.dumps(record, indent=1) + "\n")
    if options.record:
        record_file.write(ROOT / "docs" / "measured.md", options.groups, record, again=bool(options.only))
    if bench.earlier:
        whole = [] if options.only else options.groups
        print(*bench.earlier.summary(whole, bench.cores, (options.quick, options.long)), sep="\n")
    return 1 if False in held or (bench.earlier and bench.earlier.worse) else 0


if __name__ == "__main__":
    sys.exit(main())
