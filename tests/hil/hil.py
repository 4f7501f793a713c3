#!/usr/bin/env python3
"""./dev hil: the installed daemon in a virtual machine, against the kernel's own interfaces.

Boots Debian's kernel in QEMU (software emulation) with systemd as PID 1. Prints what | asked | measured | ok, writes
out/hil.json, exits 1 when a line falls short.
"""
import argparse
import json
import pathlib
import shutil
import sys
import time
import traceback

import image
import machine
import scenario
import station as stations
from station import Station

KILLS = 5
MOST_S = 10  # of a scan until the machine is killed: four views or so
COLD_S, CACHED_S = 600, 240


class Table:
    def __init__(self):
        self.lines = []

    def line(self, what, asked, measured, ok):
        self.lines.append({"what": what, "asked": asked, "measured": measured, "ok": ok})
        print(f"{what} | {asked} | {measured} | {'ok' if ok else 'NO'}", flush=True)

    def row(self, what, asked, act, *args):
        """A row that holds if `act` returns, with what it returns."""
        begin = time.monotonic()
        try:
            measured = act(*args)
            ok = True
        except (stations.Unmet, machine.Gone, RuntimeError) as problem:
            measured, ok = str(problem), False
        self.line(what, asked, f"{measured} [{time.monotonic() - begin:.0f} s]", ok)
        return ok


def render(bench_bin, cache):
    """The images that the cameras show, rendered once; and their hashes."""
    folder = cache / "images"
    if not folder.is_dir():
        making = cache / "images.part"
        shutil.rmtree(making, ignore_errors=True)
        image.run(bench_bin / "scanrig-sim", "shoot", "--out", making, "--scale", 0.25, "--poses", 1,
                  "--views", stations.VIEWS)
        making.rename(folder)
    files = sorted(folder.rglob("*.png"))
    return folder, {str(file.relative_to(folder)): stations.pixels_hash(file) for file in files}


def first_life(table, station, rendered, wanted):
    rows = [
        ("unit", "installed daemon under its unit", "active, exposure <= 2.0", scenario.unit),
        ("pose", "one pose of 8 views: libgpiod, Modbus on ftdi_sio, V4L2", "whole scan folder",
         lambda s: scenario.pose(s, rendered)),
        ("serial", "serial adapter unplugged and back", "named; back without a restart", scenario.serial_unplugged),
        ("estop", "e-stop at the GPIO line", "named e-stop", scenario.estop),
        ("camera", "cameras lost and back", "named; back without a restart", scenario.cameras_lost),
        ("killed", "daemon killed while the table turns", "made safe, restarted, Halted", scenario.killed),
        ("watchdog", "watchdog starved", "killed, made safe, restarted, Halted", scenario.watchdog),
        ("gige", "one pose of 8 views: LightCrafter over USB/IP, two GigE cameras at its trigger output",
         "whole scan folder", lambda s: scenario.usb_and_gige(s, rendered))]
    for name, what, asked, act in rows:
        if wanted and name not in wanted:
            continue
        if not table.row(what, asked, act, station):
            print(station.journal(), file=sys.stderr)


def kills(table, boot):
    """The machine killed at random, KILLS times; each life looks after what the one before has acknowledged."""
    seen = scenario.Acknowledged()
    counts = []
    problem = None
    for life in range(KILLS + 1):
        with boot() as station:
            try:
                if life > 0:
                    seen.check(station)
                if life < KILLS:
                    seen.scan_until_killed(station, MOST_S)
                    counts.append(len(seen.views))
            except (stations.Unmet, machine.Gone) as unmet:
                problem = f"life {life + 1}: {unmet}"
                break
    table.line(f"machine killed {KILLS} times at random during a scan: acknowledged views lost", "0",
               problem or f"{seen.lost} of {seen.checked} ({', '.join(map(str, counts))})",
               problem is None and seen.lost == 0)


def run(options, work, table):
    cache = image.ROOT / "build" / "hil"
    build = options.bin.parent
    begin = time.monotonic()
    cached, was_there = image.prepare(cache, [options.bin / "scanrigd", options.bin / "scanrig"])
    images, rendered = render(options.bin, cached)
    tree = work / "tree"
    stations.make_tree(build, tree, images)
    image.make_app(cached, tree, work / "app.sqfs")
    machine.make_disk(work / "disk.ext4")
    print(f"images {'cached' if was_there else 'made'}: {time.monotonic() - begin:.0f} s", flush=True)

    with stations.motion_rig.Rig(options.bin, work / "rig") as rig:
        def boot():
            return Station(work, cached, work / "app.sqfs", rig)

        with boot() as station:
            first_life(table, station, rendered, options.only)
        if not options.only or "kills" in options.only:
            kills(table, boot)
    took = time.monotonic() - begin
    if not options.only:
        limit = CACHED_S if was_there else COLD_S
        table.line(f"the whole of it, images {'cached' if was_there else 'made'}, 2 cores", f"<= {limit} s",
                   f"{took:.0f} s", took <= limit)


def main():
    parser = argparse.ArgumentParser(prog="./dev hil", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="ROW",
                        help="unit, pose, serial, estop, camera, killed, watchdog, gige, kills")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.bin = options.bin.resolve()
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
