#!/usr/bin/env python3
"""Writes a C++ source that holds the page: every file of FOLDER/*.gz, found by its path.

Usage: embed.py FOLDER OUT.cpp. Without FOLDER: a page without files.
"""
import hashlib
import pathlib
import sys

TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
         ".svg": "image/svg+xml"}

SOURCE = """// Made by web/embed.py.
#include <array>

#include "web/embedded_files.h"
{assembly}
namespace scanrig::web {{
namespace {{

std::string_view between(const char* begin, const char* end) {{ return {{begin, static_cast<std::size_t>(end - begin)}}; }}

}}  // namespace

const EmbeddedFile* find_embedded_file(std::string_view path) {{
  static const std::array<EmbeddedFile, {count}> kFiles{{{{{files}}}}};
  for (const auto& file : kFiles) {{
    if (file.path == path) return &file;
  }}
  return nullptr;
}}

std::string_view embedded_build() {{ return "{build}"; }}

}}  // namespace scanrig::web
"""

ASSEMBLY = """
asm(".section .rodata\\n"
    "scanrig_web_{n}_begin: .incbin \\"{file}\\"\\n"
    "scanrig_web_{n}_end: .byte 0\\n"
    ".previous\\n");
extern const char scanrig_web_{n}_begin[] asm("scanrig_web_{n}_begin");
extern const char scanrig_web_{n}_end[] asm("scanrig_web_{n}_end");
"""

FILE = """
      {{"{path}", "{type}", between(scanrig_web_{n}_begin, scanrig_web_{n}_end)}},"""


def main():
    *folder, out = sys.argv[1:]
    root = pathlib.Path(folder[0]).resolve() if folder else None
    paths = sorted(root.rglob("*.gz")) if root else []
    build = hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:12] if paths else ""
    names = [path.relative_to(root).with_suffix("").as_posix() for path in paths]
    assembly = "".join(ASSEMBLY.format(n=n, file=path.as_posix()) for n, path in enumerate(paths))
    files = "".join(FILE.format(n=n, path=name, type=TYPES[pathlib.Path(name).suffix]) for n, name in enumerate(names))
    text = SOURCE.format(assembly=assembly, count=len(paths), files=files, build=build)
    if not paths:
        text = text.replace("namespace {\n\nstd::string_view between(const char* begin, const char* end) { return {begin, "
                            "static_cast<std::size_t>(end - begin)}; }\n\n}  // namespace\n\n", "")
    pathlib.Path(out).write_text(text)


if __name__ == "__main__":
    main()
