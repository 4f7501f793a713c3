#!/usr/bin/env python3
"""Checks docs/guide/trouble.md: it has a row for every sentence the station says, and quotes no other.

Usage: check_trouble.py ROOT. Prints one line per finding and exits 1 if there is any.

A sentence the station says is a string literal of a source below; adjacent literals are one, what is filled in is "...".
  SAID     begins with a capital letter and has two words or a full stop, or begins with what is filled in and has both:
           the state, its cause, the next action, refusals, jobs, what a calibration found
  FAILED   three words or more in a statement with fail( or an ErrorCode: a device's or a job's failure
  NO_MODEL the same in the pipeline, of the codes with which a job ends without a model or calibration
  FOUND    the second argument of find( in the doctor; its third one is what to do
Literals that fill a "..." of these, such as a drive's alarm, are no sentences of their own. Left out are refusals of the
API's requests, problems of `scanrig check-config` and the log.

A row quotes sentences in its first cell, each between quotation marks, and then has a cause and what to do. "..." in a
quotation is any text, so that one may be for several sentences; but one that is a sentence as it stands, or has fewer than
two words of its own, is for that sentence alone. Quotation marks within a sentence are ' there. A quotation that is no
string literal of the product is a finding, too.
"""
import pathlib
import re
import sys

from check_words import CODE, STRING, cpp_parts

GUIDE = "docs/guide/trouble.md"
SAID = ("daemon/station/*", "daemon/service/safety_record.cpp", "daemon/service/service.cpp", "daemon/jobs/job_store.cpp",
        "pipeline/calibration/judge/sentences.cpp", "pipeline/calibration/watch/watch_sentences.cpp",
        "pipeline/calibration/corners/image_checks.cpp", "pipeline/calibration/drift/check_drift.cpp",
        "pipeline/calibration/placement/placement_aid.cpp")
FAILED = ("daemon/station/*", "daemon/rig/*", "daemon/jobs/*", "daemon/runtime/device_watch.h", "drivers/**/*",
          "pipeline/calibration/corners/*")
NO_MODEL = ("pipeline/**/*",)
FOUND = ("daemon/ctl/doctor/*",)
PRODUCT = ("core", "config", "daemon", "drivers", "pipeline")
NOT_OF_A_JOB = ("pipeline/importers/", "pipeline/exporters/", "pipeline/evaluate/", "pipeline/acceptance/")  # only `scanrig` at a terminal

FAILURE = re.compile(r"ErrorCode::|\bfail\(")
WITHOUT_MODEL = re.compile(
    r"ErrorCode::(same_rest|ambiguous|no_overlap|degenerate|not_closed|out_of_range|moved|below_limits)\b")
FINDING = re.compile(r'find\(\s*"",\s*(fmt::format\(\s*)?$')
FILLED_IN = re.compile(r"\{[^{}]*\}|\.\.\.")
WORD = re.compile(r"[^\W\d_]{2,}")
ANY = "\N{HORIZONTAL ELLIPSIS}"


def plain(text):
    """A sentence or a quotation in the form in which both are compared: ANY for "...", no marks beside it or at the end."""
    text = FILLED_IN.sub(ANY, text.replace("\\n", " ").replace("`", "").replace('\\"', "'"))
    return re.sub(rf"[\s.,:;']*(?:{ANY}[\s.,:;']*)+", ANY, re.sub(r"\s+", " ", text)).strip(" .,:;")


def literals(text):
    """(line, literal, code of its statement before it) of each string literal; adjacent ones are joined."""
    found, code, since = [], "", "x"
    for kind, at, part in cpp_parts(text):
        if kind == CODE:
            code += part.replace('"', "")
            since += part.replace('"', "").strip()
        elif kind == STRING:
            if found and not since:
                found[-1][1] += part
            else:
                found.append([text.count("\n", 0, at) + 1, part, re.split(r";|\}\n|\bcase ", code)[-1]])
                code += '""'
            since = ""
    return found


def is_said(literal, _statement):
    text, words = literal.strip(), WORD.findall(literal)
    if text.startswith("{"):
        return len(words) > 1 and text.endswith(".")
    return re.match("[A-Z]", text) and not text.isupper() and (" " in text or text.endswith("."))


def is_failure(literal, statement):
    return FAILURE.search(statement) and len(WORD.findall(literal)) > 2


def is_without_model(literal, statement):
    return WITHOUT_MODEL.search(statement) and len(WORD.findall(literal)) > 2


def is_found(_literal, statement):
    return FINDING.search(statement)


RULES = ((SAID, is_said), (FAILED, is_failure), (NO_MODEL, is_without_model), (FOUND, is_found))


def sources(root, patterns):
    paths = {path for pattern in patterns for path in root.glob(pattern) if path.suffix in (".cpp", ".h")}
    return sorted(path for path in paths if not path.relative_to(root).as_posix().startswith(NOT_OF_A_JOB))


def sentences(root):
    """{(file, line, literal)} of what the station says."""
    said = set()
    for patterns, rule in RULES:
        for path in sources(root, patterns):
            said |= {(path.relative_to(root).as_posix(), line, literal)
                     for line, literal, statement in literals(path.read_text()) if rule(literal, statement)}
    return said


class Quotation:
    def __init__(self, line, text):
        self.line, self.text, self.plain = line, text, plain(text)
        self.pattern = re.compile(".*".join(re.escape(piece) for piece in self.plain.split(ANY)))
        self.is_whole = len(WORD.findall(text)) < 2

    def is_of(self, sentence):
        return sentence == self.plain if self.is_whole else self.pattern.fullmatch(sentence)


def quotations(text):
    """Those of the first cells of the guide's tables."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("|"):
            for quoted in re.findall(r'"([^"]+)"', line.split("|")[1]):
                yield Quotation(number, quoted)


def main():
    root = pathlib.Path(sys.argv[1])
    guide = list(quotations((root / GUIDE).read_text()))
    known = {plain(literal) for path in sources(root, [f"{folder}/**/*" for folder in PRODUCT])
             for _, literal, _ in literals(path.read_text())}
    for quotation in guide:
        quotation.is_whole |= quotation.plain in known
    said = sentences(root)
    findings = [(file, line, f"no row of {GUIDE} quotes: {literal}") for file, line, literal in sorted(said)
                if not any(quotation.is_of(plain(literal)) for quotation in guide)]
    findings += [(GUIDE, quotation.line, f'the station does not say: "{quotation.text}"') for quotation in guide
                 if not any(quotation.is_of(literal) for literal in known)]
    for file, line, text in findings:
        print(f"{file}:{line}: {text}")
    print(f"{len(said)} sentences and {len(guide)} quotations checked, {len(findings)} findings")
    return 1 if findings or not said else 0


if __name__ == "__main__":
    sys.exit(main())
