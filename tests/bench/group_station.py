"""The station: jobs that survive, and what operators and programs see of it."""
import pathlib
import shutil
import tempfile

import station_movement
import station_disturbed
import station_fuzz
import station_kill
import station_load
import station_sanitize
import station_security
import station_soak
import station_stages
import station_startup
import station_view_cost

MEASURED = {"startup": station_startup, "movement": station_movement, "kill": station_kill,
            "disturbed": station_disturbed, "stages": station_stages, "view_cost": station_view_cost,
            "load": station_load, "security": station_security, "soak": station_soak, "fuzz": station_fuzz,
            "asan": station_sanitize.ASAN, "tsan": station_sanitize.TSAN}
PARTS = tuple(MEASURED)


def measure(bench):
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-station-"))
    try:
        for name, part in MEASURED.items():
            if bench.wants(name):
                part.measure(bench, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
