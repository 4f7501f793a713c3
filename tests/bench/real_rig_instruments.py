"""The metrologist's instruments: artefacts of known size, and flat images of the cameras."""
import json

import real_rig_scans

# Of each artefact of the simulator: its sizes, and the largest error of each result that issue 31 accepts, mm. A form is
# that of all points but 3 of 1000.
ARTEFACTS = {
    "sphere": (["--diameter", 25], {"form": 0.040, "size": 0.020}),
    "ball-bar": (["--diameter", 25, "--length", 100], {"spacing": 0.025, "form": 0.040, "size": 0.020}),
    "plane": ([], {"flatness": 0.040}),
    "step-gauge": (["--heights", "20,30,35"], {}),
}


def acceptance(bench, scratch):
    """Calibrated artefacts, scanned by a workshop that calibrated itself."""
    file = real_rig_scans.own_calibration(bench)
    for name, (sizes, limits) in ARTEFACTS.items():
        scan = scratch / name
        bench.run([bench.bin / "scanrig-sim", "shoot", "--profile", "workshop", "--material", "matt", "--object", name,
                   "--poses", 1, "--calibration", file, "--out", scan], 300, check=True)
        bench.run([bench.bin / "scanrig", "reconstruct", scan, "--no-texture"], 900, check=True)
        done = bench.run([bench.bin / "scanrig", "acceptance", name, *sizes, scan, "--json"], 120)
        if not done.stdout:
            bench.line(f"{name} of the workshop", "is measured", done.stderr.strip()[-300:], False)
            continue
        found = json.loads(done.stdout)
        for result in found["worst"]:
            what = " ".join(filter(None, (name, result["name"], result["feature"])))
            value = f"{result['value_mm']:.4f} mm, U {result['expanded_uncertainty_mm']:.4f}"
            limit = limits.get(result["name"])
            bench.line(what, f"<= {limit} mm" if limit else "reported", value,
                       abs(result["value_mm"]) <= limit if limit else True)
        for feature in found["measurements"][0]["features"]:
            bench.note(f"{name}, {feature['name']}: {feature['points']} points, rms {feature['rms_mm']:.4f} mm where sigma is "
                       f"{feature['sigma_mm'] or 0:.4f}, 95 % within {feature['range_95_mm']:.4f}, all within "
                       f"{feature['range_all_mm']:.4f}, alike within {feature['alike_mm']:.1f} mm")


def within(bench, what, limit, found, truth, digits=4):
    """A line that holds when `found` is off by at most that share of the truth."""
    off = abs(found / truth - 1)
    bench.line(what, f"within {100 * limit:.0f} % of {truth:.{digits}f}", f"{found:.{digits}f}, {100 * off:.1f} % off",
               off <= limit)


def characterise(bench, scratch):
    """Flat images of the workshop's sensors against what they were rendered with."""
    flats = scratch / "flats"
    bench.run([bench.bin / "scanrig-sim", "shoot-flats", "--profile", "workshop", "--out", flats], 600, check=True)
    done = bench.run([bench.bin / "scanrig", "camera", "characterise", "--from", flats, "--config", scratch / "none.toml",
                      "--out", scratch / "characterisation.json", "--json"], 300)
    if done.returncode != 0:
        bench.line("cameras of the workshop", "are characterised", done.stderr.strip()[-300:], False)
        return
    truth = json.loads((flats / "flats_truth.json").read_text())
    for side, camera in zip(("left", "right"), json.loads(done.stdout)["cameras"]):
        within(bench, f"{side} camera: gain K, grey per electron", 0.05, camera["gain"], truth["gain"])
        within(bench, f"{side} camera: black level of its dark images", 0.05, camera["black"],
               truth[side]["black_of_dark_images"])
        within(bench, f"{side} camera: read noise", 0.05, camera["read_noise"], truth["read_noise"])
        within(bench, f"{side} camera: PRNU", 0.10, camera["prnu"], truth["prnu"])
        within(bench, f"{side} camera: columns", 0.10, camera["column"], truth["column"])
        planted = {(pixel["x"], pixel["y"]) for pixel in truth[side]["hot_pixels"]}
        found = {(pixel["x"], pixel["y"]) for pixel in camera["hot_pixels"]}
        bench.at_least(f"{side} camera: hot pixels found, of {len(planted)}", 95, 100 * len(found & planted) / len(planted),
                       "%", digits=1)
        bench.at_most(f"{side} camera: pixels falsely hot", 0.001,
                      100 * len(found - planted) / (camera["width"] * camera["height"]), "%", digits=5)
        for remark in camera["remarks"]:
            bench.note(f"{side} camera: {remark}")
    bent = scratch / "bent"
    bench.run([bench.bin / "scanrig-sim", "shoot-flats", "--profile", "workshop", "--gamma", 0.45, "--scale", 0.5, "--out",
               bent], 600, check=True)
    command = [bench.bin / "scanrig", "camera", "characterise", "--from", bent, "--config", scratch / "none.toml", "--out",
               scratch / "bent.json", "--json"]
    done = bench.run(command, 300)
    bench.line("images with gamma", "refused by name", done.stderr.strip()[-200:], done.returncode == 3 and "gamma" in
               done.stderr)
    done = bench.run([*command, "--gamma", 0.45], 300)
    if done.returncode != 0:
        bench.line("images with gamma, named", "are characterised", done.stderr.strip()[-200:], False)
        return
    within(bench, "images with gamma, named: gain K", 0.05, json.loads(done.stdout)["cameras"][0]["gain"], truth["gain"])
