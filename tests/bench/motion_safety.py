"""Emergency stop, a killed daemon, restarts: the frames that the drive receives, by the wire's own time stamps."""
import concurrent.futures
import random
import signal
import time

import motion_rig

FAST = ("--speed-deg-s", "90", "--acceleration-deg-s2", "400", "--views", "8", "--poses", "1")
RIGS = 2 * len(motion_rig.DRIVES)
SCAN_LIMIT_S = 30
STOP_LIMIT_MS = 100
SAFE_LIMIT_S = 1.0


def in_parallel(bench, scratch, name, jobs, work, *options):
    """Results of `work(rig, n)` for each job number, run over rigs with each of the drives at once."""
    def crew(member):
        results = []
        drive = motion_rig.DRIVES[member % len(motion_rig.DRIVES)]
        with motion_rig.Rig(bench.bin, scratch / f"{name}{member}", "--drive", drive, *FAST, *options) as rig:
            for n in bench.in_time(range(member, jobs, RIGS)):
                results.append(work(rig, n))
        return results

    with concurrent.futures.ThreadPoolExecutor(RIGS) as pool:
        return [result for results in pool.map(crew, range(min(RIGS, jobs))) for result in results]


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else None


def stop_after(rig, at_ns, since, limit_s=1.0):
    """Milliseconds from `at_ns` to the first stop that the drive received after it; None without a stop."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        frames, _ = rig.frames(since)
        for frame in frames:
            if frame["at_ns"] >= at_ns and rig.kind(frame) == "stop":
                return (frame["at_ns"] - at_ns) / 1e6
        time.sleep(0.01)
    return None


def recover(rig):
    """Recovers after an edge: releases the button, presses Reset at the panel, until the table is homed."""
    rig.release("estop")
    return rig.get_ready()


def turning(rig):
    return abs(rig.truth()["speed_deg_s"]) > 1


def estop_in_scan(rig, n):
    """One edge while the table turns in a scan; its milliseconds, or None when no stop came."""
    if rig.daemon is None:
        rig.set(estop_cuts_power=False)
        rig.start_daemon()
    if not rig.machine_is("Operational.Ready") and not recover(rig):
        return None
    rig.tap("start")
    if not rig.wait(lambda: turning(rig), SCAN_LIMIT_S, 0.005):
        return None
    time.sleep(random.Random(n).uniform(0, 0.4))
    _, since = rig.frames()
    took = stop_after(rig, rig.press("estop"), since)
    recover(rig)
    return took


def report_edges(bench, what, wanted, took, limit_ms=STOP_LIMIT_MS):
    stopped = [ms for ms in took if ms is not None]
    lost = len(took) - len(stopped)
    p99 = percentile(stopped, 0.99)
    measured = "no edge" if not took else f"p99 {p99:.1f} ms, longest {max(stopped):.1f} ms, {len(took)} edges, {lost} "\
        "without a stop" if stopped else f"{lost} edges without a stop"
    ok = bool(stopped) and lost == 0 and p99 <= limit_ms and len(took) >= wanted
    bench.line(what, f"p99 <= {limit_ms} ms, {wanted} edges", measured, ok)


def estop_scan(bench, scratch):
    wanted = bench.pick(full=100, sampled=36, quick=8)
    took = in_parallel(bench, scratch, "scan", wanted, estop_in_scan)
    report_edges(bench, "e-stop edge to stop frame, during a scan", wanted, took)


def reconstructing(rig):
    jobs = (rig.ask("jobs") or {}).get("jobs", [])
    return any(job["state"] == "reconstructing" for job in jobs)


def scan_once(rig):
    """A whole job, until its reconstruction has started."""
    if not rig.machine_is("Operational.Ready") and not recover(rig):
        return False
    rig.tap("start")
    asked = [False]

    def flip_or_begun():
        flip = rig.request(get="outputs")["flip_request"]
        if flip and not asked[0]:
            rig.tap("start")
        asked[0] = flip
        return reconstructing(rig)

    return rig.wait(flip_or_begun, 120, 0.05)


def estop_reconstruction(bench, scratch):
    """Edges while reconstructions run; after each, Reset and home are required before the next."""
    crews = len(motion_rig.DRIVES)
    wanted = bench.pick(full=100, sampled=30, quick=crews)
    crew_share = -(-wanted // crews)

    def crew(member):
        took = []
        with motion_rig.Rig(bench.bin, scratch / f"rec{member}", "--drive", motion_rig.DRIVES[member], "--speed-deg-s",
                            "180", "--acceleration-deg-s2", "1000", "--views", "4" if bench.quick else "8", "--poses",
                            "2", "--voxel-mm", "0.2") as rig:
            rig.set(estop_cuts_power=False)
            rig.start_daemon(scale=0.25 if bench.quick else 0.5)
            end = time.monotonic() + min(bench.pick(full=1800, sampled=600, quick=150), bench.seconds_left())
            while len(took) < crew_share and time.monotonic() < end:
                if not reconstructing(rig) and not scan_once(rig):
                    break
                _, since = rig.frames()
                if reconstructing(rig):
                    took.append(stop_after(rig, rig.press("estop"), since))
                recover(rig)
        return took

    with concurrent.futures.ThreadPoolExecutor(crews) as pool:
        took = [ms for results in pool.map(crew, range(crews)) for ms in results]
    report_edges(bench, "e-stop edge to stop frame, during a reconstruction", wanted, took)


def killed_while_turning(rig, n):
    """Seconds from SIGKILL to stopped and dark, with make-safe run as in systemd; and whether it reported success."""
    rig.start_daemon()
    if not rig.get_ready():
        return None
    rig.tap("start")
    if not rig.wait(lambda: turning(rig), SCAN_LIMIT_S, 0.005):
        return None
    time.sleep(random.Random(n).uniform(0, 0.3))
    begun = time.monotonic()
    rig.kill_daemon(signal.SIGKILL)
    # With the daemon dead no motion starts again: the rig became safe at the first time when both hold.
    safe = lambda: rig.truth()["stopped"] and not rig.truth()["projector_on"]
    with concurrent.futures.ThreadPoolExecutor(1) as systemd:
        made = systemd.submit(rig.make_safe)
        standing = rig.wait(safe, 10, 0.005)
        took = time.monotonic() - begun
        return took if standing and made.result().returncode == 0 else float("inf")


def killed(bench, scratch):
    wanted = bench.pick(full=40, sampled=12, quick=4)
    took = in_parallel(bench, scratch, "killed", wanted, killed_while_turning)
    good = [seconds for seconds in took if seconds is not None]
    bench.line("daemon killed while the table turns, make-safe after it", f"standing and dark within {SAFE_LIMIT_S} s",
               f"longest {max(good, default=float('nan')):.2f} s of {len(good)} kills, {len(took) - len(good)} not tried",
               len(good) == wanted and max(good) <= SAFE_LIMIT_S)


def restarted(rig, n):
    """One life of the daemon, ended at random: moves and homings received before any Reset, moves without home."""
    chance = random.Random(n)
    _, since = rig.frames()
    rig.start_daemon(wait=chance.random() < 0.7)
    reset_at = None
    if chance.random() < 0.6 and rig.wait(rig.asks_for_reset, 20):
        reset_at = rig.press("reset")
        time.sleep(motion_rig.TAP_S)
        rig.release("reset")
        if chance.random() < 0.7 and rig.wait(lambda: rig.machine_is("Operational.Ready"), 15):
            rig.tap("start")
    time.sleep(chance.uniform(0, 2.5))
    rig.kill_daemon(signal.SIGKILL if chance.random() < 0.5 else signal.SIGTERM)
    rig.make_safe()
    frames, _ = rig.frames(since)
    unasked = home_lost = moves = 0
    homed = False
    for frame in frames:
        what = rig.kind(frame)
        moves += what in ("move", "home")
        unasked += what in ("move", "home") and (reset_at is None or frame["at_ns"] < reset_at)
        home_lost += what == "move" and not homed
        homed = homed or what == "home"
    return unasked, home_lost, moves, not rig.truth()["stopped"]


def restarts(bench, scratch):
    wanted = bench.pick(full=200, sampled=48, quick=8)
    lives = in_parallel(bench, scratch, "life", wanted, restarted)
    unasked, home_lost, moves, still = (sum(column) for column in zip(*lives))
    bench.line("no motion after a restart without Reset", "0 frames that move",
               f"{unasked} in {len(lives)} random restarts ({moves} motions heard in all)",
               len(lives) == wanted and unasked == 0 and moves > 0)
    bench.line("no move without home", "0 frames", f"{home_lost} in {len(lives)} random restarts", home_lost == 0)
    bench.line("standing after every end and make-safe", "all", f"{len(lives) - still} of {len(lives)}", still == 0)

