"""The Stanford dragon, upright (15 scans) and on its side (6), imported and reconstructed like any scan."""
import json
import shutil


def measure(bench):
    data = bench.data / "stanford_dragon" if bench.data else None
    if data is None or not data.is_dir():
        for what in ("dragon, pose 2, rotation", "dragon, pose 2, translation", "dragon, standing, measured area"):
            bench.line(what, "-", "not measured: the scans are not here", None)
        return
    stand, side = data / "stand/dragonStandRight.conf", data / "side/dragonSideRight_ESTIMATED.conf"
    both = figures(bench, "dragon", data, [stand, side])
    if both:
        bench.note(f"both poses: measured area {both['median_mm']:.3f} / {both['p95_mm']:.3f} mm (median / p95) from the "
                   f"merged mesh, {100 * both['measured_share']:.0f} % of the model measured")
        bench.at_most("dragon, pose 2, rotation from the given estimate", 1.0, both["pose2"]["rotation_deg"], "deg")
        bench.at_most("dragon, pose 2, translation at the object's centre", 1.5, both["pose2"]["translation_mm"], "mm")
    alone = figures(bench, "dragon-stand", data, [stand])
    if alone:
        bench.note(f"standing: {100 * alone['measured_share']:.0f} % of the model measured, p95 {alone['p95_mm']:.3f} mm")
        bench.at_most("dragon, standing, measured area to the merged mesh, median", 0.4, alone["median_mm"], "mm")
    without_positions(bench, data)


def without_positions(bench, data):
    """All scans as files without any position: joined by what they show."""
    scan = bench.out / "dragon-unknown"
    shutil.rmtree(scan, ignore_errors=True)
    files = sorted(data.glob("stand/*.ply")) + sorted(data.glob("side/*.ply"))
    done = bench.run([bench.bin / "scanrig", "import", "meshes", *files, "--out", scan, "--json"], timeout=900)
    if done.returncode != 0:
        bench.line("dragon, scans in unknown positions", "exit 0", f"{done.returncode}: {done.stderr.strip()[-200:]}", False)
        return
    found = json.loads(done.stdout)
    bench.at_most(f"dragon, {len(files)} scans in unknown positions, left out", 0, len(found["left_out"]), "scans")
    bench.at_most("dragon, the same, surfaces of two scans apart, median", 0.1, found["median_mm"], "mm")


def figures(bench, name, data, confs):
    """Result of bench_dragon for the model made of these poses, or None with a line that gives the failure."""
    scan = bench.out / name
    shutil.rmtree(scan, ignore_errors=True)
    scanrig = bench.bin / "scanrig"
    poses = [word for conf in confs for word in ("--pose", conf)]
    for command in ([scanrig, "import", "stanford", *poses, "--out", scan], [scanrig, "reconstruct", scan],
                    [bench.bin / "bench_dragon", data, scan]):
        done = bench.run(command, timeout=900)
        if done.returncode != 0:
            last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
            bench.line(f"{name}: {command[0].name} {command[1]}", "exit 0", f"{done.returncode}: {''.join(last)}", False)
            return None
    return json.loads(done.stdout)
