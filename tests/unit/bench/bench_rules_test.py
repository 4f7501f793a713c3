"""The rules of ./dev bench: budgets, samples, tables of short and long runs, names of groups."""
import io
import itertools
import pathlib
import subprocess
import sys
import tempfile
import threading
import types
import unittest
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

BENCH = pathlib.Path(__file__).resolve().parent.parent.parent / "bench"
sys.path.insert(0, str(BENCH))

import bench
import budget
import page_guide
import parts
import record
import sample
import station_kill


def quietly(function, *words):
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        return function(*words)


def made(**how):
    one = bench.Bench(".", **how)
    one.cores = 2
    return one


def group(**parts_of_it):
    return types.SimpleNamespace(PARTS=parts_of_it)


class Budgets(unittest.TestCase):
    def test_every_part_of_every_group_has_its_minutes_and_their_sum_is_within_the_limit(self):
        for name in bench.group_names():
            with self.subTest(name):
                self.assertEqual(budget.problems(name, bench.load(name).PARTS), [])

    def test_no_budget_two_places_an_unknown_part_and_too_large_a_sum_are_named(self):
        with mock.patch.dict(budget.MINUTES, {"g": {"both": 1, "gone": 1, "large": 44}}), \
                mock.patch.dict(budget.LONG, {"g": {"both"}}):
            found = "\n".join(budget.problems("g", ["both", "large", "new"]))
        for word in ("part both", "part new", "no part gone", "46 minutes"):
            self.assertIn(word, found)

    def run_parts(self, is_long=False, took_min=1.0, timeout_min=2, **parts_of_it):
        one, clock = made(is_long=is_long), [0.0]

        def part(bench_, _):
            clock[0] += 60 * took_min
            bench_.line("figure", "1", "1", True)

        measured = {"part": part, **parts_of_it}
        with mock.patch.dict(budget.MINUTES, {"g": dict.fromkeys(measured, timeout_min)}), \
                mock.patch.dict(budget.LONG, {"g": set()}), mock.patch("time.monotonic", lambda: clock[0]):
            quietly(parts.run_group, one, "g", group(**measured))
        return {line["what"]: line["ok"] for line in one.lines}

    def test_a_part_that_overruns_its_budget_falls_short_by_a_line_of_its_own(self):
        self.assertEqual(self.run_parts(took_min=1.0)["part part: time"], True)
        self.assertEqual(self.run_parts(took_min=3.0)["part part: time"], False)
        self.assertEqual(self.run_parts(took_min=3.0, is_long=True)["part part: time"], True)

    def test_no_part_begins_when_the_minutes_of_the_group_are_over(self):
        lines = self.run_parts(took_min=46.0, late=lambda bench_, _: bench_.line("late", "1", "1", True))
        self.assertEqual((lines["part late"], lines["all parts: time"], "late" in lines), (False, False, False))

    def test_a_part_that_raises_costs_the_others_nothing(self):
        def broken(*_):
            raise KeyError("broken")

        lines = self.run_parts(broken=broken, other=lambda bench_, _: bench_.line("other", "1", "1", True))
        self.assertEqual((lines["part broken"], lines["other"]), (False, True))

    def test_a_run_that_is_not_long_leaves_out_long_parts_and_ends_its_points_with_its_minutes(self):
        one, called = made(), []
        with mock.patch.dict(budget.MINUTES, {"g": {"short": 1}}), mock.patch.dict(budget.LONG, {"g": {"hours"}}):
            quietly(parts.run_group, one, "g", group(short=lambda *_: called.append("short"),
                                                     hours=lambda *_: called.append("hours")))
        self.assertEqual(called, ["short"])
        one.deadline = 0.0
        self.assertEqual(quietly(list, one.in_time([1, 2, 3])), [1])


class Beside(unittest.TestCase):
    LIMIT_S = 60

    def test_a_long_part_runs_beside_the_others_but_not_beside_one_that_must_be_alone(self):
        other_ran, ended = threading.Event(), []

        def hour(*_):
            ended.append(other_ran.wait(self.LIMIT_S))

        module = group(hour=hour, other=lambda *_: other_ran.set(), fuzz=lambda *_: ended.append("fuzz"))
        module.BESIDE, module.ALONE = ("hour",), ("fuzz",)
        one = made(is_long=True)
        quietly(parts.run_group, one, "g", module)
        self.assertEqual(ended, [True, "fuzz"])
        self.assertTrue(all(line["ok"] for line in one.lines), one.lines)


class Samples(unittest.TestCase):
    POINTS = [(number, "rare" if number % 100 == 7 else "common" if number % 2 else "usual") for number in range(300)]

    def chosen(self, count, seed=1):
        return sample.choose(self.POINTS, count, lambda point: point[1], seed)

    def test_every_kind_is_among_few_and_no_point_twice(self):
        for seed in range(20):
            few = self.chosen(12, seed)
            self.assertEqual(len(set(few)), 12)
            self.assertEqual({kind for _, kind in few}, {"rare", "common", "usual"})

    def test_the_same_seed_chooses_the_same_and_another_others(self):
        self.assertEqual(self.chosen(12), self.chosen(12))
        self.assertNotEqual(self.chosen(12), self.chosen(12, seed=2))

    def test_without_a_limit_it_is_every_point_in_order(self):
        self.assertEqual(self.chosen(None), self.POINTS)


class FakeRig:
    """A job of 40 calls that survives every fault; records the fault of each call."""

    KINDS = ("create", "write", "sync", "rename")
    program = "true"

    def __init__(self, _, scratch):
        self.home, self.crashes = scratch, itertools.count()
        self.killed, self.failed, self.fault = [], [], None

    def fresh(self, name):
        home = self.home / name
        (home / "jobs").mkdir(parents=True, exist_ok=True)
        (home / "jobs" / "index.sqlite").write_bytes(b"index")
        (home / "calibration.json").touch()
        return home

    def record(self):
        home, log = self.fresh("record"), []
        for number in range(10):
            path = f"{home}/jobs/{number}"
            log += [("create", path, "0", b""), ("write", path, "0", b"x"), ("sync", path, "", b""), ("ack", "", "", b"a"),
                    ("rename", path, path + "x", b"")]
        return home, log

    def run(self, _, __, crash=False, kill=0, when="", fail=0, **___):
        if crash:
            return subprocess.CompletedProcess([], -11 if next(self.crashes) < 2 else 0, "quarantined", "")
        self.killed += [(kill, when)] if kill else []
        self.failed += [fail] if fail else []
        return subprocess.CompletedProcess([], -9 if kill else 0, "", "")

    def recovers(self, home, again=False):
        (home / "jobs").mkdir(exist_ok=True)
        (home / "jobs" / "index.sqlite").write_bytes(b"index")
        return self.fault


class KillTest(unittest.TestCase):
    def measure(self, fault=None, **how):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.rig = FakeRig("", pathlib.Path(folder.name))
        self.rig.fault = fault
        one = made(**how)
        with mock.patch.object(station_kill, "Rig", lambda *_: self.rig):
            quietly(station_kill.measure, one, folder.name)
        return {line["what"]: line for line in one.lines}

    def test_a_long_run_takes_both_sides_of_every_call(self):
        line = self.measure(is_long=True)["SIGKILL before and after every write, fsync, rename of a job"]
        self.assertEqual((line["measured"], line["ok"]), ("0 faults at 80 points", True))
        both = {(number, when) for number in range(1, 41) for when in ("before", "after")}
        self.assertLessEqual(both, set(self.rig.killed))
        self.assertEqual(sorted(self.rig.failed), sorted(2 * list(range(1, 41))))

    def test_a_short_run_states_how_many_of_how_many_and_takes_both_sides_of_every_kind(self):
        lines = self.measure()
        line = lines["SIGKILL before and after a sampled write, fsync, rename of a job"]
        self.assertEqual((line["measured"], line["ok"]), ("0 faults at 60 of 80 points", True))
        kinds = {(FakeRig.KINDS[(number - 1) % 4], when) for number, when in self.rig.killed[:60]}
        self.assertEqual(len(kinds), 8)
        self.assertTrue(all(line["ok"] for line in lines.values()), lines)

    def test_a_kind_that_is_rare_is_killed_on_both_sides(self):
        calls = [("write",)] * 400 + [("rename",)]
        for seed in range(20):
            points = station_kill.kill_points(calls, 12, seed)
            self.assertEqual(len(points), 12)
            self.assertLessEqual({(401, "before"), (401, "after")}, set(points))
            self.assertIn(401, station_kill.call_numbers(calls, 12, seed))

    def test_one_fault_makes_its_line_fall_short(self):
        lines = self.measure(fault="view lost")
        self.assertIn("60 faults at 60 of 80 points", lines["SIGKILL before and after a sampled write, fsync, rename of a job"]
                      ["measured"])
        self.assertFalse(any(line["ok"] for what, line in lines.items() if "reconstruction" not in what))

    def test_too_few_points_fall_short(self):
        one = made()
        quietly(lambda: station_kill.report(one, "kills", [("call 1", None)] * 8, 10, of=80))
        self.assertEqual((one.lines[0]["measured"], one.lines[0]["ok"]), ("0 faults at 8 of 80 points", False))


class Tables(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "measured.md"

    def write(self, is_long, measured, commit, again=False, what="kills"):
        line = {"group": "station", "what": what, "asked": "0", "measured": measured, "ok": True}
        record.write(self.path, ["station"], {"commit": commit, "cores": 2, "long": is_long, "profile": "",
                                              "lines": [line]}, again)
        return self.path.read_text()

    def test_a_short_run_leaves_the_lines_of_a_long_one(self):
        self.write(True, "484 points", "aaaaaaa")
        text = self.write(False, "60 of 484 points", "bbbbbbb")
        self.assertIn("## station, long\n\n`./dev bench station --long` on commit aaaaaaa", text)
        self.assertIn("## station\n\n`./dev bench station` on commit bbbbbbb", text)
        self.assertIn("| kills | 0 | 484 points | yes |", text)
        self.assertIn("| kills | 0 | 60 of 484 points | yes |", text)

    def test_a_part_measured_again_names_its_commit_in_its_own_table(self):
        self.write(True, "484 points", "aaaaaaa")
        self.write(False, "60 of 484 points", "bbbbbbb")
        text = self.write(True, "485 points", "ccccccc", again=True)
        self.assertIn("| kills (on ccccccc) | 0 | 485 points | yes |", text)
        self.assertIn("| kills | 0 | 60 of 484 points | yes |", text)


class Arguments(unittest.TestCase):
    def parse(self, *words):
        with mock.patch("sys.argv", ["bench", "--bin", ".", *words]):
            return quietly(bench.arguments)

    def test_the_old_name_road_is_end_to_end(self):
        self.assertEqual(self.parse("road").groups, ["end-to-end"])  # old name
        self.assertEqual(self.parse("road", "end-to-end").groups, ["end-to-end"])  # old name

    def test_a_part_of_long_runs_alone_is_refused_without_long(self):
        self.assertRaises(SystemExit, self.parse, "station", "--only", "fuzz")
        self.assertEqual(self.parse("station", "--only", "fuzz", "--long").only, ["fuzz"])

    def test_an_unknown_part_and_a_quick_record_are_refused(self):
        self.assertRaises(SystemExit, self.parse, "station", "--only", "no-such-part")
        self.assertRaises(SystemExit, self.parse, "station", "--quick", "--record")


class GuidesThatAreFollowed(unittest.TestCase):
    def test_every_step_of_a_person_is_in_its_guide(self):
        for guide in page_guide.GUIDES:
            self.assertTrue(page_guide.actions(*guide))

    def test_steps_are_those_of_the_guide_in_its_order(self):
        texts = [step.text for step, _ in page_guide.actions(*page_guide.GUIDES[0])]
        order = [texts.index(text) for text in ("apt install ./scanrig_*.deb", "scanrig setup", "systemctl start scanrigd",
                                                "Press Reset at the panel")]
        self.assertEqual(order, sorted(order))

    def test_what_a_guide_no_longer_has_is_refused(self):
        self.assertRaises(LookupError, page_guide.actions, "install.md", {"...Press the purple button": "never"})
        self.assertRaises(LookupError, page_guide.actions, "install.md", {"scanrig no-such-verb": "never"})


if __name__ == "__main__":
    unittest.main()
