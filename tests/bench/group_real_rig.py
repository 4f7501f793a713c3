"""The rig as it is: the simulated workshop beside real images, and its calibration; one image that contradicts the
others; screens of other colours; holes and handles."""
import json

import range_pairs
import real_rig_disturbed
import real_rig_effects
import real_rig_instruments
import real_rig_materials
import real_rig_scans
import real_rig_sizes
from contradicted_images import contradicted
from screens_topology import screens, topology

MATERIALS = ("satin", "gloss", "translucent", "dark", "metal")
# A rendered figure counts as near a real one within these factors: rigs, surfaces and light differ.
NEAR = 1.5


def shoot(bench, folder, *options):
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", folder, "--views", 1, "--poses", 1, *options], 300, check=True)


def correlations(figures):
    return "{zncc_p10:.2f} / {zncc_p50:.2f} / {zncc_p90:.2f}".format(**figures)


def near(bench, what, real, rendered, digits=3):
    """A line that holds when the figure is within a factor of NEAR of the range of the real ones."""
    low, high = min(real) / NEAR, max(real) * NEAR
    bench.line(what, f"{low:.{digits}f} to {high:.{digits}f}", f"{rendered:.{digits}f}", low <= rendered <= high)


def realism(bench, scratch):
    if not bench.data:
        bench.line("rendered pairs beside real ones", "-", "not measured: the pairs are not here", None)
        return
    laboratory, workshop, faint = (scratch / name for name in ("laboratory", "workshop", "faint"))
    shoot(bench, laboratory)
    shoot(bench, workshop, "--profile", "workshop", "--true-calibration")
    shoot(bench, faint, "--profile", "workshop", "--true-calibration", "--with", "faint-dots", "--object",
          range_pairs.block(scratch / "block.ply"), "--height-mm", 100)
    parts = []
    for name in MATERIALS:
        parts.append(scratch / name)
        shoot(bench, parts[-1], "--scale", 0.5, "--profile", "workshop", "--material", name, "--true-calibration")
    picture = bench.out / "realism.jpg"  # of which docs/images has a copy
    done = bench.run([bench.bin / "bench_realism", bench.data, laboratory, workshop, faint, picture, *parts], 300, check=True)
    seen = json.loads(done.stdout)
    for name, figures in seen.items():
        lags = ", ".join(f"{value:.2f}" for value in figures["autocorrelation"])
        shares = ", ".join(f"{100 * value:.0f}" for value in figures["zncc_shares"])
        bench.note(f"{name}: contrast {figures['contrast']:.3f}, noise {100 * figures['noise']:.2f} %, autocorrelation {lags}, "
                   f"ZNCC {correlations(figures)}, of 10 classes to 1: {shares} %")
    # A laser's speckle differs from eye to eye. The projector here is a DLP, which has none: a difference by name.
    bench.line("ZNCC p10 / p50 / p90 of faint dots beside the D415's", f"reported: {correlations(seen['D415'])}",
               correlations(seen["faint dots"]), True)
    dots, textures = [seen["D415"]], [seen["teddy"], seen["cones"]]
    for what, rendered, real in (("faint dots", seen["faint dots"], dots), ("textures", seen["workshop plain"], textures)):
        name = "D415" if real is dots else "teddy, cones"
        if real is textures:
            near(bench, f"workshop {what}, median ZNCC beside {name}: 1 minus it", [1 - r["zncc_p50"] for r in real],
                 1 - rendered["zncc_p50"])
        near(bench, f"workshop {what}, autocorrelation at 2 px beside {name}", [r["autocorrelation"][1] for r in real],
             rendered["autocorrelation"][1])
        near(bench, f"workshop {what}, contrast beside {name}", [r["contrast"] for r in real], rendered["contrast"])


def calibration(bench, _scratch):
    """Boards of the workshop, and the project's own solver: as on a real rig, never the truth."""
    file = real_rig_scans.own_calibration(bench)
    judged = json.loads((file.parent / "judgement.json").read_text())
    error = json.loads(bench.run([bench.bin / "calibration_error", file, "workshop"], 60, check=True).stdout)
    bench.line("calibration of the workshop: grade", "A or B", grade := judged["grade"], grade in "AB")
    said = " ".join(judged.get("sentences", []))
    bench.line("the same: what it says of a sound rig", "nothing", said or "nothing", not said)
    bench.at_most("calibration of the workshop: volume error, rms", 15, error["rms_um"], "um", digits=1)
    bench.line("the same, predicted by the solver", "reported", f"{error['predicted_um']:.1f} um", True)


PARTS = {"realism": realism, "calibration": calibration, "materials": real_rig_materials.measure,
         "disturbed": real_rig_disturbed.measure, "effects": real_rig_effects.measure,
         "acceptance": real_rig_instruments.acceptance,
         "characterise": real_rig_instruments.characterise, "contradicted": contradicted, "screens": screens,
         "topology": topology, "sizes": real_rig_sizes.measure, **range_pairs.PARTS}
