"""Motion, light, panel: faults on the wire, emergency stop, restarts, long runs, the doctor, fuzzed parsers."""
import concurrent.futures
import pathlib
import shutil
import tempfile

import fuzz
import motion_doctor
import motion_long
import motion_matrix
import motion_safety

PARSERS = [fuzz.Parser("grbl", "GRBL"), fuzz.Parser("drive_profile", "profile files"),
           fuzz.Parser("modbus_io", "Modbus I/O", processes=48)]
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def measure(bench):
    # Short paths: a Unix socket's name has 107 characters. Readable, because the doctor is also tried as another user.
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-motion-"))
    scratch.chmod(0o755)
    try:
        with concurrent.futures.ThreadPoolExecutor() as pool:
            turns = pool.submit(motion_long.turns, bench, ROOT, scratch)
            motion_matrix.measure(bench, ROOT, scratch)
            motion_safety.measure(bench, scratch)
            motion_long.measure(bench, ROOT, scratch)
            motion_doctor.measure(bench, scratch)
            turns.result()
        # Dozens of processes: not beside what is measured in milliseconds.
        fuzz.measure(bench, ROOT, scratch, PARSERS)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
