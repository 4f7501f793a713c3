"""Commands of README.md and the guides, and the check that the programs have their verbs and options."""
import re
import shlex
import subprocess
import sys

PROGRAMS = ("scanrig", "scanrigd", "scanrigd-sim", "scanrig-sim", "./dev")
FENCE = re.compile(r"^\s*```(\S*)\s*$")
INLINE = re.compile(r"`([^`\n]+)`")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
HELP_LIMIT_S = 20


class Command:
    """One command of a guide, as it is written there; `options` are those that it and its comment name."""

    def __init__(self, where, text, comment, in_text):
        self.where, self.text = where, " ".join(text.split())
        self.words = shlex.split(self.text)
        self.program = self.words[0]
        self.in_text = in_text
        self.options = OPTION.findall(self.text) + OPTION.findall(comment)


def documents(root):
    return [root / "README.md", *sorted((root / "docs" / "guide").glob("*.md"))]


def of_line(where, line, in_text=False):
    """`a && b  # comment`; the last word may be alternatives, `on|off`."""
    code, _, comment = line.partition(" #")
    for text in re.split(r"&&|;", code):
        if text.strip():
            *before, last = text.split()
            for choice in last.split("|"):
                yield Command(where, " ".join([*before, choice]), comment, in_text)


def commands(root, not_run):
    """Each line of a fence without a language, and each quotation between backticks that begins with a program."""
    for document in documents(root):
        language = None
        for number, line in enumerate(document.read_text().splitlines(), 1):
            where = f"{document.relative_to(root)}:{number}"
            fence = FENCE.match(line)
            if fence:
                language = fence[1] if language is None else None
            elif language is None:
                for quoted in INLINE.findall(line):
                    words = quoted.split()
                    if len(words) > 1 and words[0] in (*PROGRAMS, *not_run):
                        yield from of_line(where, quoted, in_text=True)
            elif not language and not line.lstrip().startswith("#"):
                yield from of_line(where, line)


def lone_options(root):
    """(where, option) of each quotation that is only an option; old names are hidden ones."""
    for document in documents(root):
        for number, line in enumerate(document.read_text().splitlines(), 1):
            for option in re.findall(r"(?<!old name )`(--[a-z-]+)[^`]*`", line):
                yield f"{document.relative_to(root)}:{number}", option


def blocks(root, document, language):
    """Text of the fences of that language."""
    text = (root / document).read_text()
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


class Manual:
    """What the programs' --help says."""

    def __init__(self, root, binaries):
        self.root, self.binaries, self.known = root, binaries, {}

    def help(self, path):
        if path not in self.known:
            program = [str(self.binaries / path[0])]
            if path[0] == "./dev":
                demo = [sys.executable, str(self.root / "sim/apps/demo.py"), "--bin", str(self.binaries)]
                program = demo if path[1:] == ("demo",) else [str(self.root / "dev")]
            words = () if path[0] == "./dev" else path[1:]
            done = subprocess.run([*program, *words, "--help"], capture_output=True, text=True, timeout=HELP_LIMIT_S)
            self.known[path] = done.stdout if done.returncode == 0 else ""
        return self.known[path]

    def verb(self, command):
        """The program and verbs that a command begins with, and its other words.

        What a verb is about may stand before the verbs below it: `scanrig jobs ID choose N`.
        """
        path, words = (command.program,), list(command.words[1:])
        while words:
            if words[0] in self.verbs(path):
                path = (*path, words.pop(0))
            elif len(words) > 1 and self.is_about_one(path) and words[1] in self.verbs(path):
                words.pop(0)
            else:
                break
        return path, words

    def is_about_one(self, path):
        return re.search(r"^Positionals:", self.help(path), re.MULTILINE) is not None

    def names_a_verb(self, command):
        """A sentence about `scanrig queue` orders nothing."""
        return command.in_text and not self.verb(command)[1]

    def problem(self, command):
        """What the program does not have of a command, or None."""
        path, words = self.verb(command)
        who, word = " ".join(path), next(iter(words), "-")
        help_text = self.help(path)
        if not help_text:
            return f"{who} has no --help"
        if self.verbs(path) and not word.startswith("-") and not self.is_about_one(path):
            return f"{who} has no verb {word}"
        choices = re.search(r"^ +[A-Z]+ TEXT:\{([\w,]+)\} REQUIRED", help_text, re.MULTILINE)
        if choices and word not in choices[1].split(","):
            return f"{who} has no {word}"
        for option in command.options:
            if option not in OPTION.findall(help_text):
                return f"{who} has no option {option}"
        return None

    def verbs(self, path):
        if path[0] == "./dev":
            return re.findall(r"^  ([a-z]\w*) ", self.help(path), re.MULTILINE) if len(path) == 1 else []
        _, _, below = self.help(path).partition("Subcommands:\n")
        return re.findall(r"^  ([a-z][\w-]*)", below, re.MULTILINE)

    def has_option(self, option):
        """Whether any verb of scanrig has it."""
        return any(option in OPTION.findall(self.help(("scanrig", verb))) for verb in self.verbs(("scanrig",))) or any(
            option in OPTION.findall(text) for text in self.known.values())
