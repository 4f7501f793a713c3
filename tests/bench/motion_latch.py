"""A latch outlives whatever ends the daemon: no motion before Reset is pressed at the panel.

A history: an e-stop or another fault that latches, while the rig is idle or turns; told by the red lamp; the daemon
killed, ended by the watchdog, restarted, or the machine's power cut; started again with every lesser request made.
"""
import random
import shutil
import signal
import time

import motion_rig
import motion_safety
import station_disk

TROUBLES = ("estop", "guard", "alarm", "blocked", "unplugged")
ONLY_TURNING = ("guard", "blocked", "unplugged")  # no fault of a table that stands
NOT_NOTICED = {"grbl": ("blocked",)}  # an open-loop drive does not know where its table is
ENDS = ("kill", "watchdog", "restart", "power cut")
HOMINGS = ("on_reset", "guarded")
TOLD_S = 60
TURNS_S = 120  # the first view is rendered before, beside those of other rigs
UNASKED_S = 3.0  # how long the restarted daemon is watched
MOTIONS = ("move", "home")


def state_folder(rig):
    return rig.folder / "jobs" / ".state"


def set_homing(rig, wanted):
    text = rig.config.read_text()
    for other in HOMINGS:
        text = text.replace(f'home_after_restart = "{other}"', f'home_after_restart = "{wanted}"')
    rig.config.write_text(text)


def start(rig, log):
    """A daemon whose changes of the state folder are logged."""
    rig.start_daemon(wait=False, environment={"LD_PRELOAD": str((rig.bin / "disk_calls.so").resolve()),
                                              "DISK_CALLS_ROOT": str(state_folder(rig).resolve()),
                                              "DISK_CALLS_LOG": str(log)})
    if not rig.wait(lambda: rig.status() is not None, motion_rig.DAEMON_READY_S):
        raise RuntimeError(f"the daemon did not start, see {rig.folder / 'daemon.log'}")


def cause(rig, trouble):
    if trouble == "estop":
        rig.press("estop")
    elif trouble == "guard":
        rig.release("guard")
    else:
        rig.set(**{trouble: 22 if trouble == "alarm" else True})


def remedy(rig):
    """Everything is well again but the latch."""
    rig.release("estop")
    rig.press("guard")
    rig.set(alarm=0, blocked=False, unplugged=False)


def end(rig, how, log):
    number = {"watchdog": signal.SIGABRT, "restart": signal.SIGTERM}.get(how, signal.SIGKILL)
    rig.kill_daemon(number)
    if how != "power cut":
        rig.make_safe()
        return
    disk = station_disk.Disk(str(state_folder(rig).resolve()))
    for entry in station_disk.read_log(log):
        disk.apply(*entry)
    shutil.rmtree(state_folder(rig))
    disk.write_durable(state_folder(rig))


def motions(rig, since):
    frames, _ = rig.frames(since)
    return sum(rig.kind(frame) in MOTIONS for frame in frames)


def get_ready(rig):
    """Reset until the table is homed: not every cause is settled at once."""
    for _ in range(10):
        rig.tap("reset")
        if rig.wait(lambda: rig.machine_is("Operational.Ready"), 6):
            return True
    return False


def history(rig, n):
    """What was done; motions before Reset; whether Reset homed afterwards; whether the latch was told at all."""
    chance = random.Random(n)
    possible = [trouble for trouble in TROUBLES if trouble not in NOT_NOTICED.get(rig.drive, ())]
    trouble, how, homing = chance.choice(possible), ENDS[n % len(ENDS)], HOMINGS[n // len(ENDS) % len(HOMINGS)]
    what = f"{trouble}, {how}, {homing}"
    shutil.rmtree(state_folder(rig), ignore_errors=True)
    state_folder(rig).mkdir(parents=True)
    set_homing(rig, homing)
    remedy(rig)
    log = (rig.folder / "state.log").resolve()
    log.unlink(missing_ok=True)
    start(rig, log)
    try:
        if not get_ready(rig):
            return what, 0, False, False
        if trouble in ONLY_TURNING or chance.random() < 0.6:
            rig.tap("start")
            if not rig.wait(lambda: motion_safety.turning(rig), TURNS_S, 0.005):
                return f"{what}: the table did not turn", 0, False, False
        cause(rig, trouble)
        told = rig.wait(lambda: rig.request(get="outputs")["lamp_red"], TOLD_S, 0.005)
        time.sleep(chance.choice((0, 0.05, 0.5)))
        end(rig, how, log)
        remedy(rig)
        _, since = rig.frames()
        start(rig, rig.folder / "after.log")
        rig.tap("start")
        time.sleep(UNASKED_S)
        moved = motions(rig, since)
        return what, moved, get_ready(rig) and motions(rig, since) > moved, told
    finally:
        rig.kill_daemon(signal.SIGTERM)


def unlatched(rig, n):
    """The same without a trouble: a guarded rig homes by itself after a restart, or nothing above is shown."""
    shutil.rmtree(state_folder(rig), ignore_errors=True)
    set_homing(rig, "guarded")
    remedy(rig)
    _, since = rig.frames()
    rig.start_daemon(wait=False)
    homed = rig.wait(lambda: motions(rig, since) > 0, motion_rig.DAEMON_READY_S)
    rig.kill_daemon(signal.SIGTERM)
    return homed


def latches(bench, scratch):
    wanted = bench.pick(full=200, sampled=40, quick=8)
    lives = motion_safety.in_parallel(bench, scratch, "latch", wanted, history)
    for what, moved, homed, told in lives:
        if moved or not homed or not told:
            bench.note(f"{what}: {moved} motions before Reset, {'homed' if homed else 'not homed'} after it"
                       f"{'' if told else ', the red lamp was not lit'}")
    moved, told = sum(life[1] for life in lives if life[3]), sum(life[3] for life in lives)
    bench.line("a latch outlives kill, watchdog, restart and power cut", f"0 motions before Reset, {wanted} histories",
               f"{moved} motions in {told} histories with a latch, of {len(lives)}", told == wanted and moved == 0)
    homed = sum(life[2] for life in lives)
    bench.line("Reset at the panel clears the latch", "homed after it, all", f"{homed} of {len(lives)}",
               homed == len(lives))
    alone = motion_safety.in_parallel(bench, scratch, "unlatched", motion_safety.RIGS, unlatched)
    bench.line("without a latch a guarded rig homes by itself", "all", f"{sum(alone)} of {len(alone)}", all(alone))
