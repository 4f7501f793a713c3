#!/usr/bin/env python3
"""Checks which folder may include which: the arrows of docs/reference/architecture.md.

Usage: check_arrows.py ROOT. Prints one line per forbidden include and exits 1 if there is any.
"""
import pathlib
import re
import sys

DRIVER_INTERFACES = {
    "drivers/turntable/turntable.h",
    "drivers/projector/projector.h",
    "drivers/camera/stereo_camera.h",
    "drivers/panel/panel.h",
}
FOLDERS = ("core", "drivers", "pipeline", "config", "web", "daemon", "sim", "tests")
ALLOWED = {
    "core": {"core"},
    "drivers": {"drivers", "core"},
    "pipeline": {"pipeline", "core"},
    "config": {"config", "drivers", "pipeline", "core"},
    "web": {"web", "core"},
    "daemon": {"daemon", "web", "config", "drivers", "pipeline", "core"},
    "sim": {"sim", "core"},  # and the driver interfaces, see DRIVER_INTERFACES
    "sim/apps": {"sim", "daemon", "config", "drivers", "core"},
    "tests": set(FOLDERS),
}
# Leaves of the pipeline, lowest first: a leaf may include those before it.
PIPELINE_ORDER = ["calibration", "characterise", "exposures", "silhouette", "movement", "range", "registration", "mesh", "volume", "pose", "texture",
                  "model_io", "deviation", "storage", "calibrate", "acceptance", "exporters", "importers",
                  "reconstruct", "evaluate"]
# Folders of the daemon, and which others each may include.
DAEMON_ROOMS = {
    "runtime": set(),
    "station": {"runtime"},
    "rig": {"station", "runtime"},
    "journal": {"station", "runtime"},
    "jobs": {"rig", "journal", "station", "runtime"},
    "webhook": {"journal", "station", "runtime"},
    "api": {"rig", "journal", "station", "runtime"},
    "ctl": {"api", "rig", "station", "runtime", "jobs"},
    "service": {"api", "jobs", "webhook", "rig", "journal", "station", "runtime"},
}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"')


def room(path):
    parts = path.split("/")
    return "sim/apps" if parts[:2] == ["sim", "apps"] else parts[0]


def forbidden(source, target):
    """Reason why `source` may not include `target`, or None."""
    here, there = room(source), target.split("/")[0]
    if there not in FOLDERS:
        return "an include starts at the repository root"
    if here == "sim" and target in DRIVER_INTERFACES:
        return None
    if here != "tests" and room(target) == "sim/apps" and here != "sim/apps":
        return "only sim/apps knows sim/apps"
    if there not in ALLOWED[here]:
        return f"{here} must not know {there}"
    if here == there == "pipeline":
        mine, theirs = source.split("/")[1], target.split("/")[1]
        if PIPELINE_ORDER.index(theirs) > PIPELINE_ORDER.index(mine):
            return f"pipeline/{mine} comes before pipeline/{theirs}"
    if here == there == "daemon":
        mine, theirs = source.split("/")[1], target.split("/")[1]
        if mine != theirs and theirs not in DAEMON_ROOMS[mine]:
            return f"daemon/{mine} must not know daemon/{theirs}"
    return None


def main():
    root = pathlib.Path(sys.argv[1])
    bad = count = 0
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            source = path.relative_to(root).as_posix()
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                count += 1
                why = forbidden(source, match.group(1))
                if why:
                    bad += 1
                    print(f"{source}:{number}: {match.group(1)}: {why}")
    print(f"{count} includes checked, {bad} forbidden")
    return 1 if bad or not count else 0


if __name__ == "__main__":
    sys.exit(main())
