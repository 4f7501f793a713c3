#!/usr/bin/env python3
"""Checks that no term of cmake/words.txt is in use: old names, and words that a reader may misread.

Usage: check_words.py ROOT [TABLE]. Prints `file:line: term -> use X` and exits 1 if there is any.
"""
import io
import pathlib
import re
import sys
import tokenize

CODE, COMMENT, STRING = "code", "comment", "string"
CPP, MARKDOWN = {".h", ".cpp"}, {".md"}
HASH = {".toml", ".cmake", ".txt", ".in", ".service", ".socket", ".rules", ".yml", ""}
SUFFIXES = CPP | MARKDOWN | HASH | {".py"}
LEFT_OUT = {"build", "out", "node_modules"}  # folders anywhere; names that start with a dot are left out, too
TEST_FOLDERS = ("tests/unit/", "tests/component/", "tests/system/", "tests/bench/", "tests/fuzz/")
MARK = re.compile(r"\b(old names?|alias(es)?)\b|\baccept_old_name\(", re.IGNORECASE)
KINDS = {"text": {COMMENT, STRING}, "strings": {STRING}, "sentences": {STRING}, "names": {CODE}, "files": set()}
WITHOUT_TESTS = {"strings", "sentences"}
CPP_PART = re.compile(
    r'(?P<comment>//[^\n]*|/\*.*?\*/)|R"(?P<raw>[^(\n]*)\((?P<in_raw>.*?)\)(?P=raw)"|"(?P<string>(?:\\.|[^"\\\n])*)"'
    r"|(?<!\w)'(?:\\.|[^'\\\n])+'", re.DOTALL)
HASH_PART = re.compile(r'(?P<comment>(?<!\S)#[^\n]*)|"(?P<string>(?:\\.|[^"\\\n])*)"')
MARKDOWN_PART = re.compile(r"```.*?```|`[^`\n]+`", re.DOTALL)


class Rule:
    def __init__(self, kind, folders, term, use):
        self.kind, self.folders, self.use = kind, folders, use
        self.public = term.startswith("!")
        self.term = term.lstrip("!")
        self.piece = max(re.findall(r"\w+", self.term), key=len).lower()  # a file without it has no hit
        escaped = re.escape(self.term).replace(r"\*", r"\w*").replace(r"\ ", r"\s+")
        word_at_start, word_at_end = (re.match(r"[\w*]", self.term[at]) for at in (0, -1))
        if kind == "sentences":
            self.pattern = re.compile(re.escape(self.term))
        elif kind == "names":
            self.pattern = re.compile((r"(?<!\w)" if word_at_start else "") + escaped +
                                      (r"_?(?!\w)" if word_at_end else ""))
        else:
            self.pattern = re.compile((r"(?<![\w-])" if word_at_start else "") + escaped +
                                      (r"(?![\w-])" if word_at_end else ""), re.IGNORECASE)

    def covers(self, path):
        places = {path} if self.kind in WITHOUT_TESTS else {path, tested_by(path)}
        return not self.folders or any(within(place, folder) for place in places for folder in self.folders)


def tested_by(path):
    """The path without the folder of tests that mirrors the tree."""
    return next((path[len(tests):] for tests in TEST_FOLDERS if path.startswith(tests)), path)


def within(path, folder):
    return path == folder or path.startswith(folder + "/")


class Table:
    """Content of words.txt: rules, and paths with aliases or to be skipped, each with its reason."""

    def __init__(self, text):
        self.rules, self.aliases, self.skipped = [], {}, {}
        kind, folders = "", ()
        for number, line in enumerate(text.splitlines(), 1):
            line = line.strip()
            if not line or line.startswith("#"):
                continue
            if line.startswith("["):
                kind, *folders = line.strip("[]").split()
                if kind not in {*KINDS, "aliases", "skip"}:
                    sys.exit(f"words.txt:{number}: no such section: {kind}")
                continue
            term, arrow, use = line.partition(" -> ")
            if not arrow or not kind:
                sys.exit(f"words.txt:{number}: not TERM -> USE in a section")
            if kind in ("aliases", "skip"):
                (self.aliases if kind == "aliases" else self.skipped)[term] = use
            else:
                terms = [term] if kind == "sentences" else term.split(", ")
                self.rules += [Rule(kind, folders, one, use) for one in terms]


def parts_by(pattern, text):
    """(kind, start, text) of code, comments and strings, in order."""
    at = 0
    for match in pattern.finditer(text):
        yield CODE, at, text[at:match.start()]
        groups = match.groupdict()
        for name, kind in (("comment", COMMENT), ("in_raw", STRING), ("string", STRING)):
            if groups.get(name) is not None:
                yield kind, match.start(name), groups[name]
        at = match.end()
    yield CODE, at, text[at:]


def cpp_parts(text):
    includes = [match.span() for match in re.finditer(r"^[ \t]*#[ \t]*include[^\n]*", text, re.MULTILINE)]
    for kind, at, part in parts_by(CPP_PART, text):
        if kind != STRING or not any(begin <= at < end for begin, end in includes):
            yield kind, at, part


def python_parts(text):
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    kinds = {tokenize.NAME: CODE, tokenize.OP: CODE, tokenize.COMMENT: COMMENT, tokenize.STRING: STRING}
    if hasattr(tokenize, "FSTRING_MIDDLE"):
        kinds[tokenize.FSTRING_MIDDLE] = STRING
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in kinds:
            yield kinds[token.type], starts[token.start[0] - 1] + token.start[1], token.string.strip("\"'") \
                if token.type == tokenize.STRING and token.string.count("\n") == 0 else token.string


def markdown_parts(text):
    """Text between backticks is code and may be quoted text; the rest is text."""
    at = 0
    for match in MARKDOWN_PART.finditer(text):
        yield COMMENT, at, text[at:match.start()]
        yield CODE, match.start(), match.group()
        at = match.end()
    yield COMMENT, at, text[at:]


def parts(path, text):
    if path.suffix in CPP:
        return cpp_parts(text)
    if path.suffix in MARKDOWN:
        return markdown_parts(text)
    return python_parts(text) if path.suffix == ".py" else parts_by(HASH_PART, text)


def hits(rules, name, path, text):
    """(line number, rule) of every forbidden term in a file."""
    lower = text.lower()
    rules = [rule for rule in rules if rule.kind == "files" or rule.piece in lower]
    found = [(1, rule) for rule in rules if rule.kind == "files" and rule.pattern.fullmatch(path.name)]
    for kind, at, part in parts(path, text):
        for rule in rules:
            if rule.public and kind == STRING and part == rule.term:
                found.append((text.count("\n", 0, at) + 1, rule))
            elif kind in KINDS[rule.kind]:
                found += [(text.count("\n", 0, at + match.start()) + 1, rule) for match in rule.pattern.finditer(part)]
    return sorted(found, key=lambda hit: hit[0])


def files(root, skipped):
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        hidden = any(part.startswith(".") for part in name.split("/"))
        if path.suffix not in SUFFIXES or hidden or LEFT_OUT & set(name.split("/")) or not path.is_file():
            continue
        if not any(within(name, one) for one in skipped):
            yield name, path


def check(root, table):
    """Prints each forbidden term and each needless alias; returns how many."""
    bad, unused = 0, set(table.aliases)
    for name, path in files(root, table.skipped):
        try:
            text = path.read_text()
        except UnicodeDecodeError:
            continue
        lines = text.splitlines() or [""]
        for number, rule in hits([rule for rule in table.rules if rule.covers(name)], name, path, text):
            marked = bool(MARK.search(lines[number - 1]))
            if marked and name in table.aliases:
                unused.discard(name)
                continue
            bad += 1
            hint = " (marked as an alias: list the file in words.txt)" if marked else ""
            print(f"{name}:{number}: {rule.term} -> use {rule.use}{hint}")
    for name in sorted(unused):
        bad += 1
        print(f"{name}:1: listed in words.txt, but without an alias -> use no entry")
    return bad


def main():
    root = pathlib.Path(sys.argv[1])
    table = Table(pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else root / "cmake" / "words.txt").read_text())
    bad = check(root, table)
    print(f"{len(table.rules)} terms checked, {bad} found")
    return 1 if bad or not table.rules else 0


if __name__ == "__main__":
    sys.exit(main())
