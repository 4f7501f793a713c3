#!/usr/bin/env python3
"""Checks the documents: their citations exist, and they stay short. Their words are checked by check_words.py.

Usage: check_docs.py ROOT. Prints one line per finding and exits 1 if there is any.
"""
import pathlib
import re
import subprocess
import sys

TOP = ("cmake", "config", "core", "daemon", "debian", "docs", "drivers", "pipeline", "sim", "systemd", "tests", "web")
MAX_PARAGRAPH_WORDS = 120
MAX_DOC_LINES = 150
MAX_LINES = {"README.md": 60, "docs/roadmap.md": 40, "docs/status.md": 60, "docs/develop/README.md": 80,
             "docs/guide/trouble.md": 310}  # a table to look things up in
MAX_LEAF_LINES = 40
GENERATED = ("docs/measured.md", "docs/reference/states.md")  # by tests/bench/record.py and state_diagram_test.cpp
CODE = (".h", ".cpp", ".py", ".toml", ".txt", ".service", ".socket", ".rules", ".conf")
WITHOUT_README = ("tests/unit/", "tests/component/", "tests/system/", "tests/bench/")  # one README for each of these trees

FENCE = re.compile(r"^\s*```")
LINK = re.compile(r"\]\(([^)\s]+)\)")
QUOTED = re.compile(r"`([^`\n]+)`")
PATH = re.compile(r"^[\w.+*-]+(/[\w.+*-]+)*/?$")
PLACEHOLDER = re.compile(r"(^|[/._-])[A-Z]{2,}([/._-]|$)")
DOCUMENT = re.compile(r"(?<![\w/.-])((?:[\w-]+/)*[\w-]+\.md)\b")
COMMENT = re.compile(r"//|^\s*#")
LIST_ITEM = re.compile(r"^\s*([-*]|\d+\.)\s")


class Tree:
    """Files of a repository: git's list, or without git the files in its folders."""

    def __init__(self, root):
        self.root = root
        listed = subprocess.run(["git", "-C", str(root), "ls-files", "-co", "--exclude-standard"], capture_output=True,
                                text=True, check=False)
        if listed.returncode == 0:
            names = listed.stdout.splitlines()
        else:
            places = [root / top for top in TOP]
            names = [p.relative_to(root).as_posix() for place in places for p in place.rglob("*") if p.is_file()]
            names += [p.name for p in root.iterdir() if p.is_file()]
        self.files = {name for name in names if (root / name).is_file()}
        self.names = {pathlib.PurePosixPath(name).name for name in self.files}

    def has(self, path):
        path = path.rstrip("/")
        if "*" in path:
            return any(pathlib.PurePosixPath(name).match(path) for name in self.files)
        return path in self.files or (self.root / path).is_dir()

    def has_below(self, folder, name):
        """A file called `name` in `folder` or below it; a document of docs/ may name files from anywhere."""
        if folder.parts[:1] == ("docs",) or not folder.parts:
            return any(pathlib.PurePosixPath(known).match(name) for known in self.names)
        return any(path.match(name) and path.is_relative_to(folder) for path in map(pathlib.PurePosixPath, self.files))

    def documents(self):
        return sorted(name for name in self.files if name.endswith(".md"))


def is_leaf(document):
    return document.endswith("/README.md") and not document.startswith("docs/")


def without_fences(lines):
    """(number, line) of each line outside code fences."""
    inside = False
    for number, line in enumerate(lines, 1):
        if FENCE.match(line):
            inside = not inside
            yield number, ""
        elif not inside:
            yield number, line


def paragraphs(lines):
    """(first line, words): blocks between blank lines; list items, headings and table rows are blocks of their own."""
    first, words = 0, 0
    for number, line in without_fences(lines):
        alone = line.startswith(("|", "#"))
        if words and (not line.strip() or alone or LIST_ITEM.match(line)):
            yield first, words
            words = 0
        if line.strip():
            first = first if words else number
            words += len([w for w in line.split() if re.search(r"\w", w)])
    if words:
        yield first, words


def missing(tree, document, line):
    """Citations in `line` of `document` that the tree does not have."""
    folder = pathlib.PurePosixPath(document).parent
    for target in LINK.findall(line):
        if re.match(r"[a-z]+:|#", target):
            continue
        target = target.split("#")[0]
        if not (tree.root / folder / target).resolve().is_relative_to(tree.root) or not (tree.root / folder / target).exists():
            yield target
    for quoted in QUOTED.findall(line):
        if not PATH.match(quoted) or PLACEHOLDER.search(quoted.replace("README.md", "")):
            continue
        if "/" in quoted.rstrip("/"):
            beside = (folder / quoted).as_posix()
            if quoted.split("/")[0] in TOP and not tree.has(quoted) and not tree.has(beside) and not tree.has(quoted + ".h"):
                yield quoted
        elif quoted.endswith((".h", ".cpp", ".py")) and not quoted.startswith("*"):
            if not tree.has_below(folder, quoted):
                yield quoted


def check_document(tree, document):
    lines = (tree.root / document).read_text().splitlines()
    for number, line in without_fences(lines):
        for target in missing(tree, document, line):
            yield number, f"{target} does not exist"
    if document in GENERATED:
        return
    for number, words in paragraphs(lines):
        if words > MAX_PARAGRAPH_WORDS:
            yield number, f"a paragraph of {words} words, {MAX_PARAGRAPH_WORDS} at most"
    limit = MAX_LINES.get(document, MAX_LEAF_LINES if is_leaf(document) else MAX_DOC_LINES)
    if len(lines) > limit and not document.startswith("docs/measured/"):
        yield len(lines), f"{len(lines)} lines, {limit} at most"


def check_code(tree, name):
    """Documents that comments and texts of programs cite; a name without a folder counts only in a comment."""
    for number, line in enumerate((tree.root / name).read_text(errors="replace").splitlines(), 1):
        comment = COMMENT.search(line)
        for target in DOCUMENT.findall(line):
            if not tree.has(target) and ("/" in target or (comment and target not in tree.names)):
                yield number, f"{target} does not exist"


def check_rooms(tree):
    """A folder with sources has a README."""
    folders = {pathlib.PurePosixPath(name).parent.as_posix() for name in tree.files if name.endswith((".cpp", ".h"))}
    for folder in sorted(folders):
        if folder.startswith(WITHOUT_README) or folder == "cmake":
            continue
        if f"{folder}/README.md" not in tree.files:
            yield 1, f"{folder} has no README.md"


def main():
    tree = Tree(pathlib.Path(sys.argv[1]).resolve())
    itself = "cmake/check_docs.py"
    found = [(document, *finding) for document in tree.documents() for finding in check_document(tree, document)]
    code = sorted(name for name in tree.files if (name.endswith(CODE) or name == "dev") and name != itself)
    found += [(name, *finding) for name in code for finding in check_code(tree, name)]
    found += [("README.md", *finding) for finding in check_rooms(tree)]
    for name, number, text in found:
        print(f"{name}:{number}: {text}")
    print(f"{len(tree.documents())} documents and {len(code)} other files checked, {len(found)} findings")
    return 1 if found or not tree.documents() else 0


if __name__ == "__main__":
    sys.exit(main())
