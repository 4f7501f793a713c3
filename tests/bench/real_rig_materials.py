"""Objects of the workshop in six materials, measured with the rig's own calibration and held against the truth."""
import real_rig_scans

OBJECTS = ("figurine", "spot", "igea", "banana", "knot", "pawn")
# Median and p95 of measured area, mm; share of the observable truth within 0.15 mm, %.
EVEN, HARD = (0.018, 0.070, 98), (0.025, 0.10, 94)
MATERIALS = {"matt": EVEN, "satin": EVEN, "gloss": HARD, "dark": HARD, "two-tone": HARD, "translucent": None}
SEED = 4100  # of the objects here, and of no trial while building
POSE = (0.015, 0.015)
POSE_SIGMAS = 3


def cases(bench):
    """Object and material: every pair with --long; else each object once and each material once."""
    pairs = [(name, material) for name in OBJECTS for material in MATERIALS]
    if bench.long:
        return pairs
    return list(zip(OBJECTS, MATERIALS))[:bench.pick(full=6, sampled=6, quick=1)]


def judge_shape(bench, what, material, scores):
    measured, aligned, limits = scores["measured"], scores["aligned"], MATERIALS[material]
    both = f"{aligned['median_mm']:.4f} / {aligned['p95_mm']:.4f} mm"
    frame = f"in the rig's frame {measured['median_mm']:.4f} / {measured['p95_mm']:.4f}"
    if limits is None:
        bench.line(f"{what}: p95", "<= 0.25 mm", f"{both}, {frame}", aligned["p95_mm"] <= 0.25)
        return
    median, p95, covered = limits
    bench.line(f"{what}: median / p95", f"<= {median} / {p95} mm", f"{both}, {frame}",
               aligned["median_mm"] <= median and aligned["p95_mm"] <= p95)
    bench.at_least(f"{what}: observable truth within 0.15 mm", covered, 100 * scores["covered_0.15_mm"], "%")
    bench.at_most(f"{what}: measured area more than 0.25 mm off", 0.3, 100 * aligned["share_over_0.25_mm"], "%")


def judge_sigma(bench, what, scores):
    for one in scores["sigma"].get("classes", []):
        if one["count"] < 400:
            continue
        ratio, within = one["ratio"], 100 * one["share_within_2"]
        is_distance = one["name"].startswith("distances")
        asked = "94 to 97 % within 2 sigma" if is_distance else "0.85 to 1.15, 94 to 97 % within 2 sigma"
        bench.line(f"{what}: error / sigma, {one['name']}", asked, f"{ratio:.2f}, {within:.1f} %",
                   94 <= within <= 97 and (is_distance or 0.85 <= ratio <= 1.15))


def measure(bench, scratch):
    for name, material in bench.in_time(cases(bench)):
        what = f"{name}, {material}"
        options = real_rig_scans.mesh_of(bench, name, scratch)
        if options is None:
            bench.line(what, "measured", "not measured: the mesh is not here", None)
            continue
        scan, model = scratch / "scan", scratch / "model"
        real_rig_scans.shoot(bench, scan, ["--material", material, "--seed", SEED + OBJECTS.index(name), *options])
        report, failure = real_rig_scans.reconstruct(bench, scan, model)
        if report is None:
            bench.line(what, "a model", failure, False)
            continue
        scores = real_rig_scans.evaluate(bench, scan, model)
        judge_shape(bench, what, material, scores)
        judge_sigma(bench, what, scores)
        degrees, mm, sigmas = (scores["pose2_error"][key] for key in ("deg", "mm", "sigmas"))
        bench.line(f"{what}: pose 2", f"<= {POSE[0]} deg, {POSE[1]} mm, within {POSE_SIGMAS} of its sigma",
                   f"{degrees:.4f} deg, {mm:.4f} mm, {sigmas:.1f} sigma",
                   degrees <= POSE[0] and mm <= POSE[1] and sigmas <= POSE_SIGMAS)
