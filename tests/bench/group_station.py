"""The station: jobs that survive, and what operators and programs see of it."""
import pathlib
import shutil
import tempfile

import station_fuzz
import station_kill
import station_load
import station_security


def measure(bench):
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-station-"))
    try:
        station_kill.measure(bench, scratch)
        station_load.measure(bench, scratch)
        station_security.measure(bench, scratch)
        station_fuzz.measure(bench, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
