"""Lines through times, scans with fewer views, and ./dev bench --compare."""
import io
import json
import pathlib
import sys
import tempfile
import unittest
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

BENCH = pathlib.Path(__file__).resolve().parent.parent.parent / "bench"
sys.path.insert(0, str(BENCH))

import bench
import compare
import fast_runs
import fast_scaling
import fit


def line(what, asked, measured, ok=True):
    return {"group": "fast", "what": what, "asked": asked, "measured": measured, "ok": ok}


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def record(self, *lines, cores=2):
        path = self.folder / "bench.json"
        path.write_text(json.dumps({"commit": "aaaaaaa", "cores": cores, "quick": False, "long": False,
                                    "lines": list(lines)}))
        return path


class Lines(unittest.TestCase):
    def test_points_on_a_line_give_it_back(self):
        found = fit.through([(4, 9.0), (8, 17.0), (16, 33.0)])
        for value, expected in ((found.fixed, 1.0), (found.slope, 2.0), (found.worst, 0.0), (found.at(10), 21.0)):
            self.assertAlmostEqual(value, expected)

    def test_the_deviation_is_the_largest_as_a_share_of_the_line(self):
        points = [(1, 1.0), (2, 2.6), (4, 4.0)]
        found = fit.through(points)
        self.assertAlmostEqual(found.worst, max(abs(t / found.at(x) - 1) for x, t in points))
        self.assertGreater(found.worst, 0.1)

    def test_quadratic_times_are_far_from_any_line(self):
        self.assertGreater(fit.through([(x, 0.1 * x * x) for x in (4, 8, 16, 32)]).worst, 0.15)

    def test_no_line_through_one_amount_or_no_time(self):
        self.assertRaises(ValueError, fit.through, [(4, 1.0), (4, 2.0)])
        self.assertRaises(ValueError, fit.through, [(4, 1.0), (8, 0.0)])


class FewerViews(Folder):
    def scan(self, poses, views):
        scan = self.folder / "scan"
        (scan / "pose1").mkdir(parents=True)
        manifest = {"poses": [{"name": f"pose{p + 1}", "views": [{"index": v, "measured_deg": v} for v in range(views)]}
                              for p in range(poses)]}
        (scan / "scan.json").write_text(json.dumps(manifest))
        return scan

    def test_views_are_evenly_spread_and_the_scan_is_left_as_it_is(self):
        scan = self.scan(1, 16)
        few = fast_runs.thinned(scan, self.folder / "few", 4)
        views = json.loads((few / "scan.json").read_text())["poses"][0]["views"]
        self.assertEqual([view["measured_deg"] for view in views], [0, 4, 8, 12])
        self.assertEqual([view["index"] for view in views], [0, 1, 2, 3])
        self.assertEqual((few / "pose1").resolve(), (scan / "pose1").resolve())
        self.assertEqual(len(json.loads((scan / "scan.json").read_text())["poses"][0]["views"]), 16)

    def test_uneven_numbers_and_two_poses_are_refused(self):
        self.assertRaises(ValueError, fast_runs.thinned, self.scan(1, 16), self.folder / "few", 5)
        scan = self.folder / "scan"
        manifest = json.loads((scan / "scan.json").read_text())
        (scan / "scan.json").write_text(json.dumps({"poses": 2 * manifest["poses"]}))
        self.assertRaises(ValueError, fast_runs.thinned, scan, self.folder / "few", 4)

    def test_every_number_of_views_divides_the_ring_and_has_the_one_that_the_sizes_take(self):
        for counts in (fast_scaling.VIEWS, fast_scaling.LONG_VIEWS):
            self.assertTrue(all(counts[-1] % count == 0 for count in counts))
            self.assertIn(fast_scaling.VIEWS_OF_A_SIZE, counts[:2])


class Compared(Folder):
    def beside(self, before, now, tolerance=0.2):
        """What is printed beside `now`, and whether it got worse."""
        earlier = compare.Earlier(self.record(before), tolerance)
        return earlier.beside(now), bool(earlier.worse)

    def test_a_slower_time_is_worse_beyond_the_tolerance_only(self):
        before = line("whole", "<= 10 s", "30.0 s")
        self.assertEqual(self.beside(before, line("whole", "<= 10 s", "35.9 s")), ("30.0 s, x 1.20", False))
        self.assertEqual(self.beside(before, line("whole", "<= 10 s", "36.3 s")), ("30.0 s, x 1.21, WORSE", True))
        self.assertEqual(self.beside(before, line("whole", "<= 10 s", "12.0 s")), ("30.0 s, x 0.40", False))

    def test_of_what_is_to_be_large_less_is_worse(self):
        before = line("rate", ">= 5", "100")
        self.assertFalse(self.beside(before, line("rate", ">= 5", "200"))[1])
        self.assertTrue(self.beside(before, line("rate", ">= 5", "70"))[1])

    def test_reported_times_are_judged_by_their_first_number_and_counts_are_not_judged(self):
        before = line("view", "reported", "0.52 s; 98.1 %; 0.02 px")
        self.assertTrue(self.beside(before, line("view", "reported", "0.92 s; 98.1 %; 0.02 px"))[1])
        self.assertFalse(self.beside(line("share", "reported", "10 %"), line("share", "reported", "90 %"))[1])

    def test_the_last_digit_alone_is_no_loss(self):
        self.assertFalse(self.beside(line("fit", "<= 1 s", "0.02 s"), line("fit", "<= 1 s", "0.03 s"))[1])

    def test_other_units_words_and_new_lines_have_no_ratio(self):
        self.assertEqual(self.beside(line("a", "<= 1 s", "900 ms"), line("a", "<= 1 s", "0.9 s")), ("900 ms", False))
        self.assertEqual(self.beside(line("a", "equal", "equal"), line("a", "equal", "differ")), ("equal", False))
        self.assertEqual(self.beside(line("a", "<= 1", "1"), line("b", "<= 1", "1")), ("no earlier value", False))

    def test_the_time_that_a_part_takes_is_not_judged(self):
        self.assertFalse(self.beside(line("part view: time", "<= 3 min", "1.0 min"),
                                     line("part view: time", "<= 3 min", "2.9 min"))[1])

    def test_the_summary_names_what_is_worse_what_is_missing_and_other_conditions(self):
        earlier = compare.Earlier(self.record(line("a", "<= 1 s", "1.0 s"), line("b", "<= 1 s", "1.0 s")), 0.2)
        earlier.beside(line("a", "<= 1 s", "2.0 s"))
        text = "\n".join(earlier.summary(["fast"], 1, (False, False)))
        for words in ("commit aaaaaaa, tolerance 20 %: 1 worse", "worse: a: 2.0 s, was 1.0 s", "not measured now: b",
                      "2 cores then, 1 now"):
            self.assertIn(words, text)
        self.assertNotIn("not measured now", "\n".join(earlier.summary([], 2, (False, False))))


class Program(Folder):
    def run_with(self, *words):
        """Exit code and output of a run whose only line is 2.0 s."""
        module = mock.Mock(PARTS={})
        out = io.StringIO()

        def run_group(one, *_):
            one.group = "fast"
            one.at_most("whole", 10, 2.0, "s", digits=1)

        with mock.patch("sys.argv", ["bench", "--bin", ".", "fast", *map(str, words)]), \
                mock.patch.object(bench, "load", lambda _: module), mock.patch.object(bench, "ROOT", self.folder), \
                mock.patch.object(bench.parts, "run_group", run_group), redirect_stdout(out), redirect_stderr(out):
            (self.folder / "out").mkdir(exist_ok=True)
            try:
                return bench.main(), out.getvalue()
            except SystemExit as ended:
                return ended.code, out.getvalue()

    def test_worse_ends_with_1_although_the_line_holds(self):
        before = self.record(line("whole", "<= 10 s", "1.0 s"))
        code, text = self.run_with("--compare", before)
        self.assertEqual(code, 1)
        self.assertIn("whole | <= 10 s | 2.0 s | ok | 1.0 s, x 2.00, WORSE", text)
        self.assertEqual(self.run_with("--compare", before, "--tolerance", "150")[0], 0)
        self.assertEqual(self.run_with()[0], 0)

    def test_a_run_may_be_compared_with_the_file_that_it_replaces(self):
        self.assertEqual(self.run_with()[0], 0)
        code, text = self.run_with("--compare", self.folder / "out" / "bench.json")
        self.assertEqual(code, 0)
        self.assertIn("x 1.00", text)

    def test_what_is_no_record_is_refused_before_anything_runs(self):
        bad = self.folder / "bad.json"
        bad.write_text("{}")
        for path in (bad, self.folder / "missing.json"):
            self.assertEqual(self.run_with("--compare", path)[0], 2)


if __name__ == "__main__":
    unittest.main()
