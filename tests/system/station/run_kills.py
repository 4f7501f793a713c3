"""run_kills.py BIN SCRATCH: twenty of the points at which `./dev bench station` kills; exits 1 when one does not hold."""
import itertools
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "bench"))

import station_kill

rig = station_kill.Rig(sys.argv[1], sys.argv[2])
home, log = rig.record()
calls = sum(1 for entry in log if entry[0] != "ack")
points = itertools.chain(itertools.islice(station_kill.kills(rig, calls, 12 / calls / 2), 12),
                         itertools.islice(station_kill.power_cuts(rig, home, log, 0.06), 8),
                         itertools.islice(station_kill.bad_disks(rig, calls, 0.02), 4),
                         itertools.islice(station_kill.bad_disks(rig, calls, 0.02, seed=7, failures=1), 4),
                         station_kill.crashes(rig),
                         station_kill.damaged_index(rig, home, 3))
held = []
for what, fault in points:
    print(f"{'NO' if fault else 'ok'}  {what}{': ' + fault if fault else ''}", flush=True)
    held.append(not fault)
print(f"{held.count(True)} of {len(held)} hold; one job is {calls} calls")
sys.exit(0 if len(held) >= 20 and all(held) else 1)
