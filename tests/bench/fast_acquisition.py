"""Part `acquisition` of the group `fast`: what a reconstruction costs the scan beside it, and the e-stop meanwhile.

The shipped daemon and two simulated GigE cameras with images rendered beforehand. One job of two poses is scanned while
nothing is reconstructed: by the executor `process`, which begins after the last view. Then another by a daemon that
resumes the reconstruction of the first in process and matches each new view. Times are those of the cameras' edges, by
the rig's own clock. This file runs again in a network of its own.
"""
import json
import pathlib
import signal
import statistics
import sys
import time

import motion_rig
import motion_safety
import station_daemon

OPTIONS = ("--cameras", "gige", "--poses", "2", "--profile", "laboratory", "--voxel-mm", "0.25")
FULL = {"views": 16, "scale": 1.0, "edges": 60}
SAMPLED = {"views": 8, "scale": 1.0, "edges": 20}
QUICK = {"views": 4, "scale": 0.25, "edges": 2}
JOB_LIMIT_S, EDGES_LIMIT_S, LIMIT_S = 300, 180, 1500
SLOWER_LIMIT_PERCENT, STOP_LIMIT_MS = 1.0, 20


def edges_of_views(rig, since):
    return [edge for edge in rig.request(get="exposures", since=since)["exposures"] if edge["pattern"]]


def acquire(rig):
    """A whole job at a table with the object in its first placement: the job, its seconds from view to view, and the
    share of the looks in which another job was being reconstructed."""
    jobs_now = lambda: (rig.ask("jobs") or {"jobs": []})["jobs"]
    before = {job["id"] for job in jobs_now()}
    since = rig.request(get="exposures")["next"]
    rig.tap("start")
    busy, flip_before, end = [], False, time.monotonic() + JOB_LIMIT_S
    while time.monotonic() < end:
        jobs = jobs_now()
        own = [job for job in jobs if job["id"] not in before]
        if own and own[0]["state"] in ("reconstructing", *station_daemon.ENDED):
            break
        busy.append(any(job["state"] == "reconstructing" for job in jobs))
        flip = rig.request(get="outputs")["flip_request"]
        if flip and not flip_before:
            rig.request(turn_over=True)
            rig.tap("start")
        flip_before = flip
        time.sleep(0.1)
    else:
        raise RuntimeError(f"the scan did not end, see {rig.folder / 'daemon.log'}")
    edges = edges_of_views(rig, since)
    seconds = [(edge["at_ns"] - last["at_ns"]) / 1e9 for last, edge in zip(edges, edges[1:])
               if edge["placement"] == last["placement"]]
    rig.request(turn_over=True)  # the next job begins with the first placement, whose views are rendered
    return own[0]["id"], seconds, statistics.mean(busy)


def edge_beside(rig, job, number):
    """Milliseconds from an edge of the e-stop in a scan to the stop, None without one; "idle" where the reconstruction
    was over before."""
    if not rig.machine_is("Operational.Ready"):
        motion_safety.recover(rig)
    if not motion_safety.reconstructing(rig):  # before Start: what is asked for later waits for the scan
        station_daemon.order(rig.api, "POST", f"jobs/{job}/reprocess")
        rig.wait(lambda: motion_safety.reconstructing(rig), 10)
    took = motion_safety.estop_in_scan(rig, number)
    return took if motion_safety.reconstructing(rig) else "idle"


def inside(binaries, scratch, size):
    with motion_rig.Rig(binaries, scratch / "acquisition", *OPTIONS, "--views", size["views"], "--scale",
                        size["scale"]) as rig:
        executor = 'executor = "{}"'.format
        rig.edit_config(executor("in_process"), executor("process"))
        rig.start_shipped_daemon()
        rig.get_ready()
        first, quiet, _ = acquire(rig)
        rig.kill_daemon(signal.SIGTERM)
        rig.edit_config(executor("process"), executor("in_process"))
        rig.start_shipped_daemon()
        rig.get_ready()
        _, beside, busy = acquire(rig)
        rig.set(estop_cuts_power=False)
        took, end = [], time.monotonic() + EDGES_LIMIT_S
        while len(took) < size["edges"] and time.monotonic() < end:
            took += [ms for ms in [edge_beside(rig, first, len(took))] if ms != "idle"]
    print(json.dumps([quiet, beside, busy, took]))


def measure(bench, scratch):
    size = bench.pick(full=FULL, sampled=SAMPLED, quick=QUICK)
    done = bench.run([bench.bin / "scanrig-sim", "own-network", "--", sys.executable, __file__, bench.bin, scratch,
                      json.dumps(size)], LIMIT_S)
    what = "acquisition beside a reconstruction: slower by"
    if done.returncode != 0:
        bench.note(done.stderr.strip()[-500:])
        bench.at_most(what, SLOWER_LIMIT_PERCENT, None, "%")
        return
    quiet, beside, busy, took = json.loads(done.stdout.splitlines()[-1])
    for name, seconds in (("nothing reconstructed", quiet), ("beside a reconstruction", beside)):
        bench.note(f"{name}: {len(seconds)} steps from view to view, mean {statistics.mean(seconds):.3f}, median "
                   f"{statistics.median(seconds):.3f}, longest {max(seconds):.3f} s")
    bench.note(f"an earlier job was being reconstructed during {100 * busy:.0f} % of the second scan")
    bench.at_most(what, SLOWER_LIMIT_PERCENT, 100 * (statistics.mean(beside) / statistics.mean(quiet) - 1), "%", 1)
    motion_safety.report_edges(bench, "e-stop edge to stop frame, during scan and reconstruction", size["edges"], took,
                               STOP_LIMIT_MS)


if __name__ == "__main__":
    inside(sys.argv[1], pathlib.Path(sys.argv[2]), json.loads(sys.argv[3]))
