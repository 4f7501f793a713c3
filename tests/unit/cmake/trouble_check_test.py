"""check_trouble.py over small made-up trees."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
GUIDE = "docs/guide/trouble.md"


def row(quoted):
    return f"| you see | cause | do |\n|---|---|---|\n| {quoted} | cause | do |\n"


class Checked(unittest.TestCase):
    def check(self, code, guide, name="daemon/station/a.cpp"):
        """The exit code, and the findings."""
        with tempfile.TemporaryDirectory() as folder:
            for path, text in {name: code, GUIDE: guide}.items():
                (pathlib.Path(folder) / path).parent.mkdir(parents=True, exist_ok=True)
                (pathlib.Path(folder) / path).write_text(text)
            command = [sys.executable, ROOT / "cmake" / "check_trouble.py", folder]
            done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout.splitlines()[:-1]

    def assert_clean(self, code, quoted, name="daemon/station/a.cpp"):
        self.assertEqual(self.check(code, row(quoted), name), (0, []))

    def test_a_sentence_without_a_row_is_named_with_file_and_line(self):
        self.assertEqual(self.check('auto a = "One two.";\nauto b = "Three "\n  "four.";\n', row('"One two."')),
                         (1, [f"daemon/station/a.cpp:2: no row of {GUIDE} quotes: Three four."]))

    def test_a_quotation_that_no_source_has_is_named_with_its_line(self):
        self.assertEqual(self.check('auto a = "One two.";', row('"One two.", "Two three."')),
                         (1, [f'{GUIDE}:3: the station does not say: "Two three."']))

    def test_a_quotation_in_another_cell_is_no_row(self):
        code, _ = self.check('auto a = "One two.";', '| else | "One two." | do |\n')
        self.assertEqual(code, 1)

    def test_dots_are_what_is_filled_in_or_any_text(self):
        self.assert_clean('f("Job {} did not start: {}.", a);', '"Job ... did not start: ..."')
        self.assert_clean('f("No recipe \\"{}\\". Use one."); f("No recipe here.");', '"No recipe ..."')

    def test_a_quotation_of_one_word_or_of_a_whole_sentence_is_for_that_alone(self):
        self.assertEqual(self.check('f("The rig is {}."); f("The rig is busy.");', row('"The rig is ..."'))[0], 1)
        self.assertEqual(self.check('f("Job {}: {}."); f("Job {} failed.");', row('"Job ...: ..."'))[0], 1)

    def test_a_failure_is_a_sentence_of_a_driver_and_its_other_texts_are_not(self):
        code = 'auto a = "An aside in capitals.";\nreturn fail(ErrorCode::io, "{}: the port is gone", a);\n'
        self.assert_clean(code, '"...: the port is gone"', "drivers/serial/a.cpp")
        self.assertEqual(self.check(code, row('"An aside in capitals."'), "drivers/serial/a.cpp")[0], 1)

    def test_of_the_pipeline_only_what_ends_a_job_without_a_model(self):
        code = 'fail(ErrorCode::moved, "it moved a lot");\nfail(ErrorCode::invalid_input, "no such option here");\n'
        self.assert_clean(code, '"it moved a lot"', "pipeline/pose/a.cpp")

    def test_a_finding_of_the_doctor_counts_and_its_remedy_does_not(self):
        self.assert_clean('report.find("id", fmt::format("The port {} is used.", a), "Stop the other one.");',
                          '"The port ... is used."', "daemon/ctl/doctor/a.cpp")

    def test_a_tree_without_sentences_does_not_pass(self):
        self.assertEqual(self.check("int a;", ""), (1, []))


if __name__ == "__main__":
    unittest.main()
