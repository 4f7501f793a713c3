"""Minutes that each part of a group may take on two cores, without --long: the only place that states them.

The earlier build does not count. Parts in LONG run with --long only.
"""
LIMIT_MIN = 45
CORES = 2

MINUTES = {
    "station": {"startup": 2, "movement": 6, "kill": 5, "disturbed": 4, "stages": 4, "view_cost": 4, "load": 7,
                "security": 4, "soak": 9},
    "motion": {"matrix": 5, "estop": 10, "killed": 3, "restarts": 5, "latches": 4, "tools": 4,
               "turns": 5, "words": 5, "doctor": 4},
    "calibration": {"rigs": 12, "faults": 8, "models": 8, "watch": 9, "drift": 6},
    "cameras": {"triggers": 4, "matrix": 3, "wire": 12, "hil": 8, "memory": 12},
    "page": {"scenes": 5, "bars": 9, "bundle": 1, "guide": 30},
    "real-rig": {"realism": 2, "calibration": 4, "materials": 8, "disturbed": 4, "acceptance": 4, "characterise": 1,
                 "contradicted": 8, "screens": 2, "topology": 4, "rows": 3, "faint": 1, "edges": 3, "pairs": 1},
    "fast": {"view": 3, "scan": 8, "peers": 6, "scaling": 9, "live": 8, "acquisition": 6, "idle": 2},
    "pose": {"campaign": 32, "symmetric": 6, "guided_flip": 7},
    "end-to-end": {"models": 14, "render": 1, "same_model": 4, "dragon": 8, "rim": 1, "bad_input": 4, "sigkill": 4},
}
LONG = {
    "station": {"fuzz", "asan", "tsan"},
    "motion": {"fuzz"},
    "page": {"package", "arm64"},
    "calibration": {"debian13"},
    "cameras": {"debian13", "fuzz"},
    "real-rig": {"effects", "sizes"},
    "fast": {"slurm", "large"},
    "end-to-end": {"bare_machine"},
    "pose": {"poses", "fixture"},
}


def runs(group, part, is_long):
    return is_long or part not in LONG.get(group, set())


def problems(group, parts):
    """Problems of the budgets for a group with these parts, one sentence each."""
    minutes, long_only, found = MINUTES.get(group, {}), LONG.get(group, set()), []
    for part in parts:
        if (part in minutes) == (part in long_only):
            found.append(f"{group}: part {part} needs either a budget or a place in LONG")
    found += [f"{group}: there is no part {part}" for part in sorted({*minutes, *long_only} - set(parts))]
    if (total := sum(minutes.values())) > LIMIT_MIN:
        found.append(f"{group}: the parts have {total} minutes together, more than {LIMIT_MIN}")
    return found
