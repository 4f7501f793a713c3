"""The station: jobs that survive, and what operators and programs see of it."""
import pathlib
import shutil
import tempfile

import station_kill


def measure(bench):
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-station-"))
    try:
        station_kill.measure(bench, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
