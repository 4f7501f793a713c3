"""Models by a Slurm cluster of two nodes, made of Debian's packages for this part: 200 through the executor, as so many
rigs would submit them, and 200 by `scanrig farm reprocess`; meanwhile a node dies and the controller restarts."""
import os
import shutil
import statistics
import subprocess
import threading
import time

import slurm_cluster

SCANS, QUICK_SCANS = 200, 10
RIGS = 4
ALONE = 10
OPTIONS = ["--voxel-mm", "1", "--threads", "1"]


def make_scans(bench, folder, count):
    """One rendered scan and links to its files: a job's folder of its own for each."""
    shutil.rmtree(folder, ignore_errors=True)
    first = folder / "scan-000"
    bench.run([bench.bin / "scanrig-sim", "shoot", "--scale", "0.25", "--poses", "1", "--views", "4", "--out", first], 600,
              check=True)
    scans = [first]
    for number in range(1, count):
        scans.append(folder / f"scan-{number:03}")
        shutil.copytree(first, scans[-1], copy_function=os.link)
    return scans


def disturb(bench, cluster, is_over):
    """A node dies with its job, the controller restarts, the node comes back."""
    steps = [(10, lambda: cluster.kill_node("n1")), (5, cluster.stop_controller), (10, cluster.start_controller),
             (2 * slurm_cluster.NODE_LOST_S, lambda: cluster.start_node("n1"))]
    for seconds, step in steps:
        if is_over.wait(seconds):
            break
        step()
    else:
        bench.note("a node was killed and came back, the controller was restarted")
        return
    bench.note("the jobs ended before the last disturbance")
    cluster.repair()


def disturbed(bench, cluster, command, timeout):
    is_over = threading.Event()
    disturber = threading.Thread(target=disturb, args=(bench, cluster, is_over))
    disturber.start()
    begun = time.monotonic()
    try:
        done = bench.run(command, timeout, env=cluster.env)
    finally:
        is_over.set()
        disturber.join()
    return done, time.monotonic() - begun


def whole_models(scans):
    return sum((scan / "model" / "report.json").exists() and (scan / "model" / "model.glb").exists() for scan in scans)


def leftovers(scans):
    return sum((scan / name).exists() for scan in scans for name in ("slurm", "slurm.json", "model.new"))


def judge(bench, what, scans, done, failed):
    """All are done or named, none is lost, none was reported twice; a model for each that is done, and for no other."""
    lost = len({str(scan) for scan in scans} - set(done) - set(failed))
    twice = len(done) + len(failed) - len(set(done) | set(failed))
    bench.line(f"{what}: done, failed by name, lost, twice; whole models; left behind", f"{len(scans)} done or named, 0, 0; as done; 0",
               f"{len(done)}, {len(failed)}, {lost}, {twice}; {whole_models(scans)}; {leftovers(scans)}",
               lost == 0 and twice == 0 and whole_models(scans) == len(set(done)) and leftovers(scans) == 0)


def clear(scans):
    for scan in scans:
        shutil.rmtree(scan / "model", ignore_errors=True)


def executor(bench, cluster, scans):
    program = [bench.bin / "bench_slurm", bench.bin / "scanrig"]
    direct = []
    for scan in scans[:ALONE]:
        begun = time.monotonic()
        bench.run([bench.bin / "scanrig", "reconstruct", scan, *OPTIONS], 300, check=True)
        direct.append(time.monotonic() - begun)
    clear(scans)
    alone = bench.run([*program, 1, *scans[:ALONE]], 600, env=cluster.env).stdout.splitlines()
    seconds = [float(line.split("\t")[0]) for line in alone if not line.startswith("failed")]
    overhead = statistics.median(seconds) - statistics.median(direct) if len(seconds) == ALONE else None
    bench.at_most("slurm, executor: overhead a job, median of 10, idle cluster", 3.0, overhead, "s", digits=2)
    clear(scans)
    run, wall = disturbed(bench, cluster, [*program, RIGS, *scans], 3600)
    lines = [line.split("\t") for line in run.stdout.splitlines()]
    failed = [words[1] for words in lines if words[0] == "failed"]
    for words in [words for words in lines if words[0] == "failed"][:3]:
        bench.note(" ".join(words))
    judge(bench, "slurm, executor, a node killed, controller restarted", scans,
          [words[1] for words in lines if words[0] != "failed"], failed)
    bench.line("slurm, executor: seconds for all; core-seconds of one directly", "reported",
               f"{wall:.0f} s for {len(scans)}; {statistics.median(direct):.2f} s", True)
    clear(scans)
    return statistics.median(direct)


def farm(bench, cluster, scans, direct):
    command = [bench.bin / "scanrig", "farm", "reprocess", *scans, "--with", "--voxel-mm 1", "--program",
               bench.bin / "scanrig", "--cores", 1, "--memory-gib", 1]
    run, wall = disturbed(bench, cluster, command, 3600)
    lines = run.stdout.splitlines()
    done = [line.split()[1] for line in lines if line.startswith("done ")]
    failed = [line.split()[1].rstrip(":") for line in lines if line.startswith("failed ")]
    if run.returncode != 0:
        bench.note(" ".join((run.stderr or "").split())[-300:])
    judge(bench, "slurm, farm, a node killed, controller restarted", scans, done, failed)
    bench.line("slurm, farm: seconds for all; core-seconds of one directly", "reported",
               f"{wall:.0f} s for {len(scans)}; {direct:.2f} s", True)
    again = bench.run(command, 600, env=cluster.env).stdout.splitlines()
    expected = f"0 done, 0 failed, {len(scans)} skipped"
    bench.line("slurm, farm: again", expected, again[-1] if again else "no line", again == [expected])


def measure(bench, scratch):
    if missing := slurm_cluster.install():
        bench.line("slurm: 200 jobs on two nodes", "measured", f"not measured: no {', '.join(missing)} here", None)
        return
    scans = make_scans(bench, scratch / "slurm-scans", bench.pick(SCANS, SCANS, QUICK_SCANS))
    with slurm_cluster.Cluster(scratch / "slurm") as cluster:
        try:
            direct = executor(bench, cluster, scans)
            farm(bench, cluster, scans, direct)
        except subprocess.CalledProcessError as error:
            bench.line("slurm: the scans", "made", " ".join(error.stderr.split())[-200:], False)
