"""run_kills.py BIN SCRATCH: twenty of the points at which `./dev bench station` kills; exits 1 when one does not hold."""
import itertools
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "bench"))

import station_kill

rig = station_kill.Rig(sys.argv[1], sys.argv[2])
home, log = rig.record()
calls = station_kill.calls_of(log)
points = itertools.chain(station_kill.kills(rig, station_kill.kill_points(calls, 12)),
                         station_kill.power_cuts(rig, home, log, station_kill.call_numbers(calls, 8)),
                         station_kill.bad_disks(rig, station_kill.call_numbers(calls, 4, seed=5)),
                         station_kill.bad_disks(rig, station_kill.call_numbers(calls, 4, seed=7), seed=7, failures=1),
                         station_kill.crashes(rig),
                         station_kill.damaged_index(rig, home, 3))
held = []
for what, fault in points:
    print(f"{'NO' if fault else 'ok'}  {what}{': ' + fault if fault else ''}", flush=True)
    held.append(not fault)
print(f"{held.count(True)} of {len(held)} hold; one job is {len(calls)} calls")
sys.exit(0 if len(held) >= 20 and all(held) else 1)
