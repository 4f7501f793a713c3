"""Three and four poses: objects with deep hollows, rendered and reconstructed; then one pose is another object's."""
import json
import os
import shutil

import hollow_objects
import real_rig_scans

SCALE, POSES, HEIGHT_MM = 0.5, 4, 80
MAX_UNSEEN, MIN_SHARE_SEEN = 0.02, 0.9  # of the objects: 18 of 20
MAX_SECONDS = 6.0                       # of the stage `pose`, two quiet cores


def shoot(bench, scan, file, poses, seed):
    ran = bench.run([bench.bin / "scanrig-sim", "shoot", "--out", scan, "--object", file, "--height-mm", HEIGHT_MM,
                     "--poses", poses, "--scale", SCALE, "--seed", seed], 900)
    return ran.returncode == 0, ran.stderr.strip()[-200:]


def pose_errors(bench, scan, model):
    scores = real_rig_scans.evaluate(bench, scan, model)
    return [error for error in [scores.get("pose2_error"), *scores.get("further_pose_errors", [])] if error]


def seen(bench, scan, model):
    ran = bench.run([bench.bin / "bench_seen_share", scan, model], 600)
    return json.loads(ran.stdout) if ran.returncode == 0 else None


def swapped(scan, pose, other, folder):
    """A copy of `scan` whose pose of this number is that of another scan; the views' files are links."""
    shutil.copytree(scan, folder, copy_function=os.link, ignore=shutil.ignore_patterns(f"pose{pose + 1}", "model*"))
    shutil.copytree(other / f"pose{pose + 1}", folder / f"pose{pose + 1}", copy_function=os.link)
    manifest = json.loads((scan / "scan.json").read_text())
    manifest["poses"][pose] = json.loads((other / "scan.json").read_text())["poses"][pose]
    (folder / "scan.json").unlink()
    (folder / "scan.json").write_text(json.dumps(manifest))
    return folder


def pose_seconds(report):
    return sum(stage["seconds"] for stage in report["stages"] if stage["stage"] == "pose")


def whole(bench, objects, folder):
    """Scans and models of all poses; figures by object."""
    done = []
    for number, (name, file) in enumerate(objects):
        scan = folder / name.replace(" ", "_")
        is_shot, why = shoot(bench, scan, file, POSES, number + 1)
        if not is_shot:
            bench.line(f"{name}: is scanned", "yes", why, False)
            continue
        report, why = real_rig_scans.reconstruct(bench, scan, scan / "model")
        figures = seen(bench, scan, scan / "model") if report else None
        errors = pose_errors(bench, scan, scan / "model") if report else []
        done.append({"name": name, "scan": scan, "report": report, "why": why, "seen": figures, "errors": errors})
        if report and figures:
            left = [pose["pose"] + 1 for pose in report["pose_graph"]["left_out"]]
            bench.note(f"{name}: unseen {100 * figures['unseen']:.2f} % of what can be seen; views of 1 to {POSES} poses "
                       f"leave {', '.join(f'{100 * u:.1f}' for u in figures['unseen_after_poses'])} %; "
                       f"poses off by {max((e['deg'] for e in errors), default=0):.4f} deg, "
                       f"{max((e['mm'] for e in errors), default=0):.4f} mm; left out: {left or 'none'}; "
                       f"{report['pose_graph']['searches']} searches, {pose_seconds(report):.2f} s")
        else:
            bench.note(f"{name}: {why}")
    return done


def one_of_another_object(bench, done, folder):
    """One pose of each scan is the next object's, each place in turn."""
    found, wrong = 0, []
    for number, one in enumerate(done):
        pose, other = number % POSES, done[(number + 1) % len(done)]["scan"]
        scan = swapped(one["scan"], pose, other, folder / f"swapped_{number}")
        report, why = real_rig_scans.reconstruct(bench, scan, scan / "model")
        left = [entry["pose"] for entry in report["pose_graph"]["left_out"]] if report else []
        if left == [pose]:
            found += 1
        else:
            wrong.append(f"{one['name']}: pose {pose + 1} is another's, left out: {[p + 1 for p in left]} {why}")
        shutil.rmtree(scan, ignore_errors=True)
    bench.line("one pose of another object: found and left out by name", f"{len(done)} of {len(done)}",
               f"{found} of {len(done)}" + "".join("; " + text for text in wrong), found == len(done))


def refused(bench, done, folder):
    """Nine poses: one sentence, a code, nothing changed."""
    scan = shutil.copytree(done[0]["scan"], folder / "nine", copy_function=os.link,
                           ignore=shutil.ignore_patterns("model*"))
    manifest = json.loads((scan / "scan.json").read_text())
    manifest["poses"] = [{**manifest["poses"][n % POSES], "name": f"pose{n + 1}"} for n in range(9)]
    (scan / "scan.json").unlink()
    (scan / "scan.json").write_text(json.dumps(manifest))
    ran = bench.run([bench.bin / "scanrig", "reconstruct", scan], 60)
    said = ran.stderr.strip()
    is_refused = ran.returncode not in (0, 124) and "1 to 8 poses, not 9" in said and len(said.splitlines()) == 1
    bench.line("nine poses are refused in one sentence, no model is made", "yes", said[-200:],
               is_refused and not (scan / "model").exists())


def measure(bench, scratch):
    folder = scratch / "many"
    folder.mkdir(parents=True, exist_ok=True)
    objects = hollow_objects.all_objects(folder)[:bench.pick(20, 20, 2)]
    done = whole(bench, objects, folder)
    if not done:
        return
    enough = sum(1 for one in done if one["seen"] and one["seen"]["unseen"] <= MAX_UNSEEN)
    wanted = int(MIN_SHARE_SEEN * len(done))
    bench.line(f"{POSES} poses: unseen share below {100 * MAX_UNSEEN:g} % of what can be seen",
               f">= {wanted} of {len(done)} objects", f"{enough} of {len(done)}", enough >= wanted)
    models = [one for one in done if one["report"]]
    errors = sorted(error["deg"] for one in models for error in one["errors"])
    if errors:
        bench.line("error of the poses", "reported", f"median {errors[len(errors) // 2]:.4f} deg, largest {errors[-1]:.4f} "
                   f"deg, {max(e['mm'] for one in models for e in one['errors']):.4f} mm", True)
        bench.at_most("estimation and refinement, four poses, slowest", MAX_SECONDS,
                      max(pose_seconds(one["report"]) for one in models), "s", 2)
    one_of_another_object(bench, models, folder)
    refused(bench, done, folder)
