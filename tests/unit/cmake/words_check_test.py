"""check_words.py over small made-up trees."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
TABLE = """
[text]
spoilt, see to -> retake
[text drivers docs/reference/safety.md]
standing -> stopped
[strings daemon]
the daemon -> the service
[names daemon/station]
Words -> OperatorMessage
!not_begun -> not_started
*Asked -> *Requested
[names]
least_* -> min_*
look( -> capture_preview(
[files]
hand.py -> control_client.py
[sentences daemon]
Resume it, leave -> Do not move the part
[aliases]
config/keys.h -> keys of old files
[skip]
tests/corpus -> inputs
"""


class Checked(unittest.TestCase):
    def check(self, files, table=TABLE):
        """The exit code, and the lines about files."""
        if "config/keys.h" not in files:
            table = table.replace("config/keys.h -> keys of old files", "")
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"cmake/words.txt": table, **files}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            command = [sys.executable, ROOT / "cmake" / "check_words.py", root]
            done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.stderr, "")
        return done.returncode, [line for line in done.stdout.splitlines()[:-1] if not line.startswith("cmake/words.txt")]

    def assert_found(self, files, *lines):
        self.assertEqual(self.check(files), (1, list(lines)))

    def assert_clean(self, files):
        _, lines = self.check(files)
        self.assertEqual(lines, [])

    def test_words_in_comments_strings_and_documents_are_found_in_any_case(self):
        self.assert_found({"core/a.cpp": "int a;  // Spoilt\nauto b = \"see  to it\";\n"},
                          "core/a.cpp:1: spoilt -> use retake", "core/a.cpp:2: see to -> use retake")
        self.assert_found({"docs/status.md": "# A\n\nIt is spoilt.\n"}, "docs/status.md:3: spoilt -> use retake")
        self.assert_found({"tests/a.py": '"""One\nspoilt"""\n'}, "tests/a.py:2: spoilt -> use retake")
        self.assert_found({"config/a.toml": "a = 1  # spoilt\n"}, "config/a.toml:1: spoilt -> use retake")

    def test_text_rules_leave_identifiers_and_parts_of_words_alone(self):
        self.assert_clean({"core/a.cpp": "int spoilt = 1;  // unspoilt\n#include \"core/spoilt/a.h\"\n"})

    def test_a_string_may_hold_comment_marks_and_a_comment_quotes(self):
        self.assert_clean({"daemon/a.cpp": 'auto a = "http://x";  // "the daemon"\nint b = 1\'000;\nchar c = \'"\';\n'})
        self.assert_found({"daemon/a.cpp": 'auto a = R"(x // the daemon)";\n'},
                          "daemon/a.cpp:1: the daemon -> use the service")

    def test_a_folder_limits_a_rule_to_itself_and_the_tests_that_mirror_it(self):
        self.assert_clean({"pipeline/a.cpp": "Words a;  // standing\n", "docs/reference/states.md": "standing\n",
                           "drivers2/a.cpp": "// standing\n"})
        self.assert_found({"tests/unit/daemon/station/a_test.cpp": "Words a;\n"},
                          "tests/unit/daemon/station/a_test.cpp:1: Words -> use OperatorMessage")
        self.assert_found({"docs/reference/safety.md": "standing\n"}, "docs/reference/safety.md:1: standing -> use stopped")

    def test_sentences_for_operators_are_not_searched_in_tests(self):
        self.assert_clean({"tests/unit/daemon/a.cpp": 'f("the daemon", "Resume it, leave it");\n'})
        self.assert_found({"daemon/a.cpp": 'f("Resume it, leave it");\n'},
                          "daemon/a.cpp:1: Resume it, leave -> use Do not move the part")

    def test_names_are_found_in_code_with_wildcards_and_as_members(self):
        self.assert_found({"daemon/station/a.h": "StartAsked a;\nWords words_;  // Words\nint least_size_;\nx.look(1);\n"},
                          "daemon/station/a.h:1: *Asked -> use *Requested",
                          "daemon/station/a.h:2: Words -> use OperatorMessage",
                          "daemon/station/a.h:3: least_* -> use min_*",
                          "daemon/station/a.h:4: look( -> use capture_preview(")
        self.assert_clean({"daemon/station/a.h": "int AskedFor, at_least_one, WordsOf, overlook(int);\n"})

    def test_a_public_name_is_found_as_a_whole_string_too(self):
        self.assert_found({"daemon/station/a.cpp": 'auto a = j["not_begun"];\nauto b = "not_begun yet";\n'},
                          "daemon/station/a.cpp:1: not_begun -> use not_started")

    def test_names_in_documents_are_those_between_backticks(self):
        self.assert_found({"daemon/station/README.md": "Words are `Words`.\n"},
                          "daemon/station/README.md:1: Words -> use OperatorMessage")

    def test_an_alias_needs_a_mark_on_its_line_and_its_file_in_the_table(self):
        marked = "int least_size;  // old name\n"
        self.assert_clean({"config/keys.h": marked})
        self.assert_clean({"config/keys.h": "section.accept_old_name(min_size, least_size);\n"})
        self.assert_clean({"config/keys.h": "int least_size;  // Old names\n"})
        self.assert_found({"config/keys.h": "int least_size;\nint least_mass;  // alias\n"},
                          "config/keys.h:1: least_* -> use min_*")
        _, lines = self.check({"core/a.h": marked})
        self.assertEqual(lines, ["core/a.h:1: least_* -> use min_* (marked as an alias: list the file in words.txt)"])

    def test_an_entry_without_an_alias_is_named(self):
        self.assert_found({"config/keys.h": "int size;\n"},
                          "config/keys.h:1: listed in words.txt, but without an alias -> use no entry")

    def test_files_are_found_by_name_and_skipped_folders_are_left_alone(self):
        self.assert_found({"sim/hand.py": "\n"}, "sim/hand.py:1: hand.py -> use control_client.py")
        self.assert_clean({"tests/corpus/a.toml": "least_a = 1\n", "build/a.cpp": "// spoilt\n", ".git/a.md": "spoilt\n"})

    def test_a_tree_without_forbidden_terms_passes(self):
        table = TABLE.replace("[skip]", "[skip]\ncmake/words.txt -> this table")
        self.assertEqual(self.check({"core/a.cpp": "int a;\n"}, table), (0, []))

    def test_the_table_of_this_project_can_be_read(self):
        files = {"core/a.cpp": "// nobody\n"}
        table = (ROOT / "cmake" / "words.txt").read_text().replace("tests/bench/bench.py ->", "config/keys.h ->")
        self.assertEqual(self.check(files, table)[1][0][:23], "core/a.cpp:1: nobody ->")

    def test_a_word_of_each_kind_is_noticed_by_the_table_of_this_project(self):
        planted = {"docs/status.md": ("Measure the closure.", "closure"),
                   "daemon/a.cpp": ('auto a = "ask the daemon";', "the daemon"),
                   "drivers/a.cpp": ('auto a = "the bus fell silent";', "fell silent"),
                   "drivers/turntable/a.h": ("bool flank_loaded_ = false;", "flank_loaded"),
                   "tests/system/hand.py": ("", "hand.py")}
        files = {name: text + "\n" for name, (text, _) in planted.items()}
        code, lines = self.check(files, (ROOT / "cmake" / "words.txt").read_text())
        self.assertEqual(code, 1)
        for name, (_, term) in planted.items():
            self.assertTrue(any(line.startswith(f"{name}:1: {term} -> ") for line in lines), f"{name}: {lines}")


if __name__ == "__main__":
    unittest.main()
