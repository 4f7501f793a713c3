"""Cameras of other resolutions, and rigs of half and twice the size: errors go with the size of a pixel on the object.

A rig of another size is one that is similar in everything, its optics and mechanics too: it takes the same images, and
every length is another. What the pipeline then does differently, a constant in millimetres did."""
import hashlib
import json
import shutil
import struct

import real_rig_scans

# Share of 1280x960, the workshop's own.
CAMERAS = {"0.3 MP": 0.5, "1.2 MP": 1.0, "5 MP": 2.0}
RIGS = {"half the size": 0.5, "twice the size": 2.0}
NEAR = 0.25
ONE_POSE = ["--poses", 1, "--views", 8]
RIM_DOTS = (40, 84.5, 2.4)  # number, radius and diameter, mm


def change(file, edit):
    """Edits a JSON file in place."""
    content = json.loads(file.read_text())
    edit(content)
    file.write_text(json.dumps(content))


def times(content, keys, size):
    for key in keys:
        content[key] *= size


def moved(transform, size):
    transform["translation"] = [size * value for value in transform["translation"]]


def resize_boards(boards, size):
    """The boards as a rig `size` times as large sees them."""
    def edit(images):
        times(images, ["table_radius_mm"], size)
        board = images["board"]
        times(board, ["square_mm", "thickness_mm"], size)
        times(board["markers"], ["size_mm"], size)
        for length in board["lengths"]:
            times(length, ["mm", "sigma_mm"], size)
    change(boards / "calibration_images.json", edit)


def resize_ply(file, size):
    """Vertices of a binary PLY of three floats each."""
    data = file.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(data[:start].split(b"element vertex ")[1].split(b"\n")[0])
    end = start + 12 * count
    vertices = struct.unpack(f"<{3 * count}f", data[start:end])
    file.write_bytes(data[:start] + struct.pack(f"<{3 * count}f", *(size * value for value in vertices)) + data[end:])


def resize_truth(scan, size):
    """The truth of a scan, for its evaluation."""
    def edit(truth):
        times(truth, ["table_radius_mm"], size)
        for camera in ("left", "right"):
            moved(truth[camera]["camera_from_turntable"], size)
        moved(truth["projector"]["projector_from_turntable"], size)
        for pose in truth["poses"]:
            moved(pose["table_from_truth"], size)
    change(scan / "truth.json", edit)
    resize_ply(scan / "truth.ply", size)
    for file in ("rig_truth.json", "truth_calibration.json"):  # what is not asked here
        (scan / file).unlink(missing_ok=True)


def use_calibration(scan, file):
    """`file` as the scan's calibration, as if it had been taken with it."""
    content = file.read_bytes()
    (scan / "calibration.json").write_bytes(content)
    change(scan / "scan.json", lambda manifest: manifest["calibration"].update(sha256=hashlib.sha256(content).hexdigest()))


def calibrate(bench, boards, size=1.0):
    """calibration.json of the boards; or None and why there is none."""
    file = boards / "calibration.json"
    count, radius, diameter = RIM_DOTS
    done = bench.run([bench.bin / "scanrig", "calibrate", boards, "--json", "--out", file, "--rim-dots",
                      f"{count}x{size * radius:g}x{size * diameter:g}"], 1800)
    return (file, "") if done.returncode == 0 else (None, " ".join(done.stderr.split())[-200:])


def errors(bench, scan, model):
    """Median and p95, um; or None and why there is no model."""
    report, failure = real_rig_scans.reconstruct(bench, scan, model)
    if report is None:
        return None, failure
    aligned = real_rig_scans.evaluate(bench, scan, model)["aligned"]
    return (1000 * aligned["median_mm"], 1000 * aligned["p95_mm"]), ""


def of_cameras(bench, folder, scale):
    """Errors with cameras of this resolution."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    boards = folder / "boards"
    bench.run([bench.bin / "scanrig-sim", "shoot-board", *real_rig_scans.WORKSHOP, "--scale", scale, "--out", boards], 3600,
              check=True)
    calibration, failure = calibrate(bench, boards)
    if calibration is None:
        return None, failure
    bench.run([bench.bin / "scanrig-sim", "shoot", *real_rig_scans.WORKSHOP, "--scale", scale, "--calibration", calibration,
               *ONE_POSE, "--out", folder / "scan"], 3600, check=True)
    return errors(bench, folder / "scan", folder / "model")


def of_rig(bench, base, folder, size):
    """Errors of a rig `size` times as large as that of `base`, whose images it takes."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(base, folder, ignore=lambda _, names: [name for name in names if name == "model"])
    resize_boards(folder / "boards", size)
    calibration, failure = calibrate(bench, folder / "boards", size)
    if calibration is None:
        return None, failure
    use_calibration(folder / "scan", calibration)
    resize_truth(folder / "scan", size)
    return errors(bench, folder / "scan", folder / "model")


def measure(bench, scratch):
    base = scratch / "cameras-1.0"
    found = {f"cameras of {name}": (scale, *of_cameras(bench, scratch / f"cameras-{scale}", scale))
             for name, scale in CAMERAS.items()}
    found |= {f"a rig of {name}": (1.0 / size, *of_rig(bench, base, scratch / f"rig-{size}", size))
              for name, size in RIGS.items()}
    middle = found["cameras of 1.2 MP"][1]
    for name, (pixels_per_mm, own, failure) in found.items():
        if own is None:
            bench.line(name, "a model", failure, False)
        elif middle is not None:
            # Of a pixel: 1 where the error is that of the workshop itself, in its pixels.
            relative = [error / of_middle * pixels_per_mm for error, of_middle in zip(own, middle)]
            bench.line(f"{name}: median, p95; in pixels, beside those of 1.2 MP", f"within {100 * NEAR:.0f} %",
                       "{:.1f}, {:.1f} um; {:.2f}, {:.2f}".format(*own, *relative),
                       all(abs(value - 1.0) <= NEAR for value in relative))
