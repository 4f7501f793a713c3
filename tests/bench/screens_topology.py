"""Screens of other colours, none, and an object as blue as the screen; holes and handles of objects of known genus."""
import pierced_objects
import real_rig_scans

MAX_CLOSED_WRONGLY = 0.03
SAME_COVERAGE = 0.01


HALF = ("--scale", 0.5), ("--voxel-mm", 0.4)
WHOLE = (), ()


def scan(bench, folder, *options, resolution=HALF):
    """Scores of the model, or why there is none."""
    of_images, of_model = resolution
    bench.run([bench.bin / "scanrig-sim", "shoot", "--out", folder, *of_images, "--poses", 1, "--views", 12, *options],
              600, check=True)
    done = bench.run([bench.bin / "scanrig", "reconstruct", folder, "--no-texture", *of_model], 300)
    if done.returncode != 0:
        return None, " ".join(done.stderr.split())[-200:]
    return real_rig_scans.evaluate(bench, folder, folder / "model"), "; ".join(done.stderr.split("\n")).strip("; ")


def coverage(scores):
    return scores["covered_0.15_mm"]


def screens(bench, scratch):
    workshop = ("--profile", "workshop", "--true-calibration")
    cases = {"blue": (), "green": ("--screen", "green"), "none": ("--screen", "none"),
             "workshop": (*workshop, "--material", "matt"), "blue object": (*workshop, "--material", "screen-blue")}
    sound = {}  # with the blue screen, by profile
    for name, options in cases.items():
        scores, said = scan(bench, scratch / name.replace(" ", "-"), *options)
        if scores is None:
            bench.line(f"screen: {name}", "a model", said, False)
            continue
        base = sound.setdefault("workshop" if workshop[0] in options else "laboratory", scores)
        wrong = scores["whole"]["share_over_0.50_mm"] - base["whole"]["share_over_0.50_mm"]
        if said:
            bench.note(f"{name}: {said}")
        if name == "none":
            bench.at_most("no screen: area more than 0.5 mm off, beyond that with a blue screen", 100 * MAX_CLOSED_WRONGLY,
                          100 * wrong, "%", digits=2)
        elif scores is not base:
            least = coverage(base) - SAME_COVERAGE
            bench.at_least(f"screen: {name}: observable surface within 0.15 mm", 100 * least, 100 * coverage(scores), "%")


def topology(bench, scratch):
    objects = [(*one, 100, HALF) for one in pierced_objects.all_objects()]
    objects += [(*one, pierced_objects.FINE_EXTENT_MM, WHOLE) for one in pierced_objects.fine_objects()]
    right, crossing = 0, 0
    for number, (name, genus, mesh, extent_mm, resolution) in enumerate(objects):
        file = pierced_objects.write(scratch / f"object{number}.ply", mesh)
        scores, said = scan(bench, scratch / f"scan{number}", "--object", file, "--height-mm", extent_mm,
                            resolution=resolution)
        found = scores["topology"] if scores else {"genus": None, "self_intersecting_faces": 0}
        right += 1 if found["genus"] == genus else 0
        crossing += found["self_intersecting_faces"]
        if found["genus"] != genus:
            bench.note(f"{name}: genus {found['genus']} instead of {genus} {said if not scores else ''}")
    bench.line("genus of objects with holes and handles, 0 to 5, holes from 3 mm", f"right in {len(objects)}", str(right),
               right == len(objects))
    bench.line("the same: faces that cross another", "none", str(crossing or "none"), crossing == 0)
