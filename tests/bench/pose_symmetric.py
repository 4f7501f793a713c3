"""Objects that turns carry onto themselves, the same with a bump that is nearly lost in the noise, objects that were not
turned over, and poses of another object: range images as those of the campaign."""
import pose_campaign

SYMMETRIC, BUMPS, NOT_TURNED, OTHERS = (40, 12, 4), (20, 6, 4), (20, 6, 4), (20, 6, 4)  # whole, sampled, quick
RIGHT_DEG = 1.0  # farther off a motion is not the true one; the smallest turn of the objects is 45 deg


def is_wrong(trial):
    """A model without a word about other motions that fit, or one whose surface is wrong."""
    if trial["verdict"] != "model":
        return False
    return trial["surface_mm"][2] > pose_campaign.WRONG_MM or (
        "symmetry" not in trial and trial["rotation_deg"] > RIGHT_DEG)


def named(trial):
    found = trial.get("symmetry", {"group": "none", "fold": 1})
    return found["group"], found["fold"]


def is_named(trial):
    return trial["verdict"] == "model" and named(trial) == (trial["made"]["group"], trial["made"]["fold"])


def told(trial):
    if trial["verdict"] != "model":
        return f"{pose_campaign.of(trial)}: {trial['verdict']}: {trial.get('message', '')[:160]}"
    group, fold = named(trial)
    return (f"{pose_campaign.of(trial)}: {group} {fold}, {trial['rotation_deg']:.2f} deg, surface at most "
            f"{trial['surface_mm'][2]:.2f} mm off")


def all_of(bench, what, trials, is_right):
    right = [trial for trial in trials if is_right(trial)]
    bench.line(what, f"{len(trials)} of {len(trials)}", f"{len(right)} of {len(trials)}", len(right) == len(trials))
    for trial in trials:
        if not is_right(trial):
            bench.note(f"{what}, but not {told(trial)}")


def measure(bench, scratch):
    def trials_of(series, count):
        return pose_campaign.played(bench, series, bench.pick(*count))

    symmetric = trials_of("symmetric", SYMMETRIC)
    all_of(bench, "symmetric objects: a model whose surface is right", symmetric,
           lambda trial: trial["verdict"] == "model" and not is_wrong(trial))
    all_of(bench, "symmetric objects: the symmetry is named", symmetric, is_named)
    all_of(bench, "nearly symmetric objects: no wrong answer without a word", trials_of("bumps", BUMPS),
           lambda trial: not is_wrong(trial) and trial["verdict"] in ("model", "ambiguous"))
    all_of(bench, "not turned over: said so", trials_of("not-turned-over", NOT_TURNED),
           lambda trial: trial["verdict"] == "same_rest")
    all_of(bench, "pose 2 is another object: no model", trials_of("another-object", OTHERS),
           lambda trial: trial["verdict"] not in ("model", "not drawn") and "exit code" not in trial["verdict"])
