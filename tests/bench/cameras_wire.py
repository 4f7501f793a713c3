"""The whole job over the wire: time of the daemon's software beside the devices, the same bits as in one process,
and the accuracy of the group end-to-end."""
import hashlib
import json
import shutil

import group_end_to_end

SETTLING_S = 0.2  # of the simulated table
MODEL = ("model.glb", "model.ply", "model.obj", "model.stl")


def views(stamps):
    """Exposures of each view: pattern and plain, and retakes."""
    grouped, angle = [], None
    for exposure in stamps["exposures"]:
        here = (exposure["placement"], round(exposure["angle_deg"]))
        if here != angle:
            grouped.append([])
        angle = here
        grouped[-1].append(exposure)
    return grouped


def overheads_ms(stamps):
    """Time of each view that the table turned for: from the last frame of the view before (of a pose's first: the last
    motion) to its own last frame, without motion, settling, exposure and readout as the simulator stamped them."""
    found, before = [], None
    for view in views(stamps):
        begin = before[-1]["read_ns"] if before else 0
        end = view[-1]["read_ns"]
        legs = [leg for leg in stamps["legs"] if begin <= leg["begun_ns"] < view[0]["at_ns"]]
        first = not before or before[0]["placement"] != view[0]["placement"]
        before = view
        if not legs:
            continue
        if first:
            legs = legs[-1:]
            begin = legs[0]["begun_ns"]
        moving = sum(leg["ended_ns"] - leg["begun_ns"] for leg in legs)
        seen = sum(each["read_ns"] - each["at_ns"] for each in view)
        found.append((end - begin - moving - seen) / 1e6 - 1e3 * SETTLING_S)
    return found


def p95(values):
    ordered = sorted(values)
    return ordered[max(0, -(-95 * len(ordered) // 100) - 1)]


def hashes(folder):
    """Hashes of every frame in its place, and of every model file."""
    scan = json.loads((folder / "scan.json").read_text())
    frames = {file["path"]: file["sha256"] for pose in scan["poses"] for view in pose["views"]
              for file in view["files"].values()}
    models = {name: hashlib.sha256((folder / "model" / name).read_bytes()).hexdigest() for name in MODEL}
    return frames, models


def demo(bench, name, options):
    """Folder of a demo that ended well, or None; prints the reason."""
    folder = bench.out / name
    shutil.rmtree(folder, ignore_errors=True)
    done, _ = group_end_to_end.demo(bench, folder, options)
    if done.returncode == 0 and (folder / "scores.json").is_file():
        return folder
    bench.line(name, "a model", f"none: {(done.stderr or done.stdout).strip()[-200:]}", False)
    return None


def same_bits(bench, options):
    here, wire = demo(bench, "in_process", options), demo(bench, "over_the_wire", ["--wire", *options])
    if not here or not wire:
        return
    (frames, models), (far_frames, far_models) = hashes(here), hashes(wire)
    same = sum(frames[path] == far_frames.get(path) for path in frames)
    bench.line("noise off: frames over the wire as in one process, SHA-256", f"{len(frames)} of {len(frames)}",
               f"{same} of {len(far_frames)}", same == len(frames) == len(far_frames))
    same = [name for name in models if models[name] == far_models[name]]
    bench.line("noise off: model files over the wire as in one process, SHA-256", ", ".join(MODEL),
               ", ".join(same) or "none", len(same) == len(MODEL))


def measure(bench):
    seeds = group_end_to_end.SEEDS[:bench.pick(full=3, sampled=1, quick=1)]
    same_bits(bench, ["--no-noise", "--scale", 0.25] if bench.quick else ["--no-noise"])
    overheads = []
    for seed in seeds:
        name = f"wire_figurine_{seed}"
        folder = demo(bench, name, ["--wire", "--seed", seed])
        if not folder:
            continue
        stamps = json.loads((folder / "stamps.json").read_text())
        overheads += overheads_ms(stamps)
        lost = sum(len(view) - 2 for view in views(stamps))
        bench.line(f"wire, figurine seed {seed}: exposures retaken", "reported", f"{lost} of {len(stamps['exposures'])}",
                   True)
        group_end_to_end.accuracy(bench, "wire, figurine", seed, folder)
    bench.at_most(f"software beside motion, settling, exposure, readout: p95 of {len(overheads)} views", 50,
                  p95(overheads) if overheads else None, "ms", 1)
