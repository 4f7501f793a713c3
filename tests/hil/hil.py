#!/usr/bin/env python3
"""./dev hil: the installed daemon in a virtual machine, against the kernel's own interfaces.

Boots Debian's kernel in QEMU (software emulation) with systemd as PID 1. Prints what | asked | measured | ok, writes
out/hil.json, exits 1 when a line does not hold.
"""
import argparse
import json
import os
import pathlib
import resource
import shutil
import sys
import time
import traceback

import image
import machine
import scenario
import station as stations
from station import Station

MOST_S = 5  # of a scan, until the machine is killed
COLD_S, CACHED_S = 660, 300
CORES = 2


class Table:
    def __init__(self):
        self.lines = []

    def line(self, what, asked, measured, ok):
        self.lines.append({"what": what, "asked": asked, "measured": measured, "ok": ok})
        print(f"{what} | {asked} | {measured} | {'ok' if ok else 'NO'}", flush=True)

    def row(self, what, asked, act, *args):
        """A row that holds if `act` returns, with its result."""
        begin = time.monotonic()
        try:
            measured = act(*args)
            ok = True
        except (stations.Unmet, machine.Gone, RuntimeError) as problem:
            measured, ok = str(problem), False
        self.line(what, asked, f"{measured} [{time.monotonic() - begin:.0f} s]", ok)
        return ok


def render(bench_bin, cache):
    """Images that the cameras show, rendered once; and their hashes."""
    folder = cache / "images"
    if not folder.is_dir():
        making = cache / "images.part"
        shutil.rmtree(making, ignore_errors=True)
        image.run(bench_bin / "scanrig-sim", "shoot", "--out", making, "--scale", 0.25, "--poses", 1,
                  "--views", stations.VIEWS)
        making.rename(folder)
    files = sorted(folder.rglob("*.png"))
    return folder, {str(file.relative_to(folder)): stations.pixels_hash(file) for file in files}


def rows(rendered):
    """Name, what, asked, act; one list per life of the machine. Each life but the last is ended by a kill."""
    return [
        [("unit", "installed daemon under its unit", "active, exposure <= 2.0", scenario.unit),
         ("failing", f"daemon failing {scenario.FAILURES} times in a row", "socket stays; then answered",
          scenario.failing),
         ("serial", "serial adapter unplugged and back", "named; back without a restart", scenario.serial_unplugged)],
        [("estop", "e-stop at the GPIO line", "named e-stop", scenario.estop)],
        [("camera", "cameras lost and back", "named; back without a restart", scenario.cameras_lost)],
        [("killed", "daemon killed while the table turns", "made safe, restarted, Halted", scenario.killed)],
        [("watchdog", "watchdog starved", "killed, made safe, restarted, Halted", scenario.watchdog)],
        [("pose", "one pose of 8 views: libgpiod, Modbus on ftdi_sio, V4L2", "whole scan folder",
          lambda s: scenario.pose(s, rendered)),
         ("gige", "one pose of 8 views: LightCrafter over USB/IP, two GigE cameras at its trigger output",
          "whole scan folder", lambda s: scenario.usb_and_gige(s, rendered)),
         ("shipped_example", "config/rigs/example.toml: libgpiod, Modbus on ftdi_sio, two GigE cameras",
          "two poses of 8 views", lambda s: scenario.shipped_example(s, rendered)),
         ("uart", "table homed and turned: Modbus on the kernel's 8250", "at its angle", scenario.uart),
         ("vivid", "two vivid devices as a pair: V4L2", "images, a pair on disk", scenario.vivid)]]


def live(table, station, acts):
    for _, what, asked, act in acts:
        if not table.row(what, asked, act, station):
            print(station.journal(), file=sys.stderr)


def live_and_die(table, boot, lives):
    """Kills the machine at random times, during a scan; each life checks the acknowledged views of the one before."""
    seen = scenario.Acknowledged()
    problems = []
    for number, acts in enumerate(lives):
        with boot() as station:
            try:
                if seen.job:
                    seen.check(station)
                live(table, station, acts)
                if number + 1 < len(lives):
                    seen.kill(station, MOST_S)
            except (stations.Unmet, machine.Gone) as problem:
                problems.append(f"life {number + 1}: {problem}")
    held = not problems and seen.kills == len(lives) - 1 and seen.lost == 0
    measured = "; ".join([f"{seen.kills} kills, {seen.lost} of {seen.checked} views lost", *problems])
    table.line(f"machine killed {len(lives) - 1} times at random during a scan: acknowledged views lost", "0", measured,
               held)


def cpu_s():
    """Processor seconds of all ended processes that this program started."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(options, work, table):
    cache = image.ROOT / "build" / "hil"
    build = options.bin.parent
    begin, cpu_before_s = time.monotonic(), cpu_s()  # earlier processes built the programs
    if options.cold:
        shutil.rmtree(cache, ignore_errors=True)
    cached, was_there = image.prepare(cache, [options.bin / name for name in stations.PROGRAMS])
    system, booted = image.prepare_system(cached)
    was_there = was_there and booted
    images, rendered = render(options.bin, cached)
    tree = work / "tree"
    stations.make_tree(build, tree, images)
    image.make_app(tree, work / "app.sqfs")
    machine.make_disk(work / "disk.ext4")
    print(f"images {'cached' if was_there else 'made'}: {time.monotonic() - begin:.0f} s", flush=True)

    with stations.motion_rig.Rig(options.bin, work / "rig") as rig:
        app = work / "app.sqfs"
        installed = stations.install(work, system, app, rig.folder / "turntable")
        print(f"the project installed: {time.monotonic() - begin:.0f} s", flush=True)

        def boot():
            return Station(work, system, app, rig, installed)

        if options.only:
            with boot() as station:
                live(table, station, [row for acts in rows(rendered) for row in acts if row[0] in options.only])
        else:
            live_and_die(table, boot, rows(rendered))
    took = time.monotonic() - begin
    if not options.only:
        limit = CACHED_S if was_there else COLD_S
        table.line(f"the whole of it, images {'cached' if was_there else 'made'}, {CORES} cores", f"<= {limit} s",
                   f"{took:.0f} s, {cpu_s() - cpu_before_s:.0f} s of processor", took <= limit)


def main():
    parser = argparse.ArgumentParser(prog="./dev hil", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="ROW",
                        help="unit, failing, serial, estop, camera, killed, watchdog, pose, gige, shipped_example, "
                        "uart, vivid; without the kills of the machine")
    parser.add_argument("--cold", action="store_true", help="make the machine's images anew, and render what it sees")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.bin = options.bin.resolve()
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])  # also for all child processes
    work = image.ROOT / "out" / "hil"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    table = Table()
    print("what | asked | measured | ok")
    try:
        run(options, work, table)
    except (RuntimeError, OSError) as problem:
        traceback.print_exc()
        table.line("the virtual machine", "runs to its end", str(problem), False)
    (image.ROOT / "out" / "hil.json").write_text(json.dumps(table.lines, indent=1) + "\n")
    held = [line["ok"] for line in table.lines]
    print(f"{held.count(True)} held, {held.count(False)} fell short")
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main())
