"""Finding how an object was turned over, on many: range images are synthesised from meshes with the errors of the range
stage, of the turntable's angles and of a calibration that is off by its own covariance.

Half of the trials run beside the other half, each on one thread. SCANRIG_CAMPAIGN_SEED draws other trials than the
bench's own, SCANRIG_CAMPAIGN_TRIALS another number.
"""
import concurrent.futures
import json
import os

import mesh_shapes

TRIALS, QUICK_TRIALS, SEED = 400, 12, 3301
GENERATORS_EVERY = 4
BATCH = 4  # trials of one process: what is not begun when the time is over is not begun
WRONG_MM = 0.25  # farthest that pose 2's surface may be put elsewhere
MAX_WITHOUT, MAX_MEDIAN_DEG, MAX_MEDIAN_MM, MIN_EGI, MAX_S = 0.01, 0.01, 0.01, 0.9, 2.0
WITHIN = ((2, 0.95), (4, 0.999))


def played(bench, series, count, generators_every=0):
    """All trials of a series, in their order; also written to out/bench/campaign_SERIES.jsonl."""
    seed, files = os.environ.get("SCANRIG_CAMPAIGN_SEED", SEED), list(mesh_shapes.found_elsewhere(bench).values())

    def batch(first):
        if bench.seconds_left() <= 0:
            return []
        size = min(BATCH, count - first)
        ran = bench.run([bench.bin / "bench_campaign", series, seed, first, size, generators_every, *files], 3600)
        trials = [json.loads(line) for line in ran.stdout.splitlines() if line.endswith("}")]
        if ran.returncode != 0:
            trials.append({"trial": first, "verdict": f"exit code {ran.returncode}", "message": ran.stderr[-200:]})
        return trials

    with concurrent.futures.ThreadPoolExecutor(max(1, min(2, bench.cores))) as pool:
        trials = [trial for some in pool.map(batch, range(0, count, BATCH)) for trial in some]
    (bench.out / f"campaign_{series}.jsonl").write_text("".join(json.dumps(trial) + "\n" for trial in trials))
    if len(trials) < count:
        bench.line(f"trials of {series}", f"{count}", f"{len(trials)}", False)
    return trials


def quantile(values, share):
    """Nearest rank."""
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))] if values else None


def of(trial):
    return f"trial {trial['trial']} ({trial.get('object', '-')})"


def ratios(trials, what, directions):
    """Errors in their own sigmas."""
    return [abs(trial[what][k]["error"]) / max(trial[what][k]["sigma"], 1e-12)
            for trial in trials for k in directions if what in trial]


def sureness(bench, trials):
    for what, name in (("rotation", "rotation"), ("translation", "translation")):
        for directions, which in (((0,), "weakest direction"), ((2,), "strongest direction"), ((0, 1, 2), "all three")):
            found = ratios(trials, what, directions)
            if not found:
                continue
            shares = [sum(ratio <= limit for ratio in found) / len(found) for limit, _ in WITHIN]
            is_limit = what == "rotation" and which != "strongest direction"
            ok = not is_limit or all(share >= asked for share, (_, asked) in zip(shares, WITHIN))
            asked = ", ".join(f"{100 * share:g} % within {limit}" for limit, share in WITHIN)
            text = ", ".join(f"{100 * share:.1f} % within {limit}" for share, (limit, _) in zip(shares, WITHIN))
            bench.line(f"error of {name} in its own sigmas, {which}", asked if is_limit else "reported",
                       f"{text}; median {quantile(found, 0.5):.2f}, largest {max(found):.1f}", ok)


def verdicts(bench, trials):
    models = [trial for trial in trials if trial["verdict"] == "model"]
    wrong = [trial for trial in models if trial["surface_mm"][2] > WRONG_MM]
    missing = [trial for trial in trials if trial["verdict"] != "model"]
    bench.line(f"wrong surfaces (farther than {WRONG_MM} mm off)", "0", f"{len(wrong)} of {len(trials)}", not wrong)
    share = len(missing) / len(trials)
    bench.line("without a model", f"<= {100 * MAX_WITHOUT:g} %", f"{len(missing)} of {len(trials)}",
               share <= MAX_WITHOUT)
    for trial in wrong:
        bench.note(f"wrong: {of(trial)}: {trial['surface_mm'][2]:.2f} mm, {trial['rotation_deg']:.2f} deg, "
                   f"{trial.get('symmetry', {}).get('group', 'no symmetry')}")
    for trial in missing:
        bench.note(f"missing: {of(trial)}: {trial['verdict']}: {trial.get('message', '')[:160]}")
    return models


def generators(bench, trials):
    tried = [trial["generators"] for trial in trials if "generators" in trial]
    for name in ("hull", "egi", "point pairs"):
        hits = sum(each[name] for each in tried)
        if not tried:
            continue
        text = f"{100 * hits / len(tried):.0f} %, {hits} of {len(tried)}"
        if name == "egi":
            bench.line("found by egi alone", f">= {100 * MIN_EGI:g} %", text, hits >= MIN_EGI * len(tried))
        else:
            bench.line(f"found by {name} alone", "reported", text, True)


def measure(bench, scratch):
    count = int(os.environ.get("SCANRIG_CAMPAIGN_TRIALS", bench.pick(TRIALS, TRIALS, QUICK_TRIALS)))
    trials = played(bench, "flips", count, GENERATORS_EVERY)
    if not trials:
        return bench.line("trials", "some", "none", False)
    models = verdicts(bench, trials)
    plain = [trial for trial in models if "symmetry" not in trial]
    sureness(bench, plain)
    bench.at_most("rotation, median error", MAX_MEDIAN_DEG, quantile([t["rotation_deg"] for t in plain], 0.5), "deg", 4)
    bench.at_most("translation, median error", MAX_MEDIAN_MM, quantile([t["translation_mm"] for t in plain], 0.5), "mm",
                  4)
    bench.note(f"95 %: {quantile([t['rotation_deg'] for t in plain], 0.95) or 0:.4f} deg, "
               f"{quantile([t['translation_mm'] for t in plain], 0.95) or 0:.4f} mm; overlap "
               f"{min((t['overlap'] for t in trials if 'overlap' in t), default=0):.2f} at least; "
               f"{len(models) - len(plain)} symmetric")
    generators(bench, trials)
    for what, key in (("estimation", "estimate_s"), ("refinement", "refine_s")):
        seconds = [trial[key] for trial in trials if key in trial]
        bench.at_most(f"{what}, 95 % of trials, one thread", MAX_S, quantile(seconds, 0.95), "s", 2)
