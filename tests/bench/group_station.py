"""The station: jobs that survive, and what operators and programs see of it."""
import pathlib
import shutil
import tempfile

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

PARTS = (station_startup, station_kill, station_disturbed, station_stages, station_view_cost, station_load,
         station_security, station_soak, station_fuzz, station_sanitize)


def measure(bench):
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-station-"))
    try:
        for part in PARTS:
            part.measure(bench, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
