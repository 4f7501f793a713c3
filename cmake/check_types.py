#!/usr/bin/env python3
"""Checks that no two files define a type of the same name in the same namespace (the one-definition rule).

Usage: check_types.py ROOT. Prints one line per name defined twice and exits 1 if there is any. The linker notices
nothing: it takes one of the two, and the other's callers use the wrong one. Types in unnamed namespaces are left out,
as are the nested ones. It relies on the formatting that ./dev lint enforces: these definitions start in column 1.
"""
import collections
import pathlib
import re
import sys

FOLDERS = ("core", "drivers", "pipeline", "config", "daemon", "sim")
OPENS = re.compile(r"(?:inline )?namespace ([\w:]*)\s*\{")
CLOSES = re.compile(r"\}\s*// namespace")
DEFINES = re.compile(r"(?:struct|class|enum class|union)\s+(?:\[\[\w+\]\]\s*)?(\w+)(?:\s+final)?\s*(?::[^:;].*)?\{")


def defined_types(text):
    """Qualified names of the types that `text` defines outside unnamed namespaces."""
    spaces = []
    for line in text.splitlines():
        if opened := OPENS.match(line):
            spaces.append(opened.group(1))
        elif CLOSES.match(line) and spaces:
            spaces.pop()
        elif (defined := DEFINES.match(line)) and all(spaces):
            yield "::".join([*spaces, defined.group(1)])


def main():
    root = pathlib.Path(sys.argv[1])
    places = collections.defaultdict(set)
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                for name in defined_types(path.read_text()):
                    places[name].add(path.relative_to(root).as_posix())
    bad = {name: files for name, files in places.items() if len(files) > 1}
    for name, files in sorted(bad.items()):
        print(f"{name} is defined in {' and '.join(sorted(files))}: rename one")
    print(f"{len(places)} types checked, {len(bad)} defined twice")
    return 1 if bad or not places else 0


if __name__ == "__main__":
    sys.exit(main())
