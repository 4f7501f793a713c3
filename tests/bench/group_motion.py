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
PARTS = ("matrix", "estop", "killed", "restarts", "turns", "words", "doctor", "fuzz")
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def measure(bench):
    # Short paths: a Unix socket's name has 107 characters. Readable, because the doctor is also tried as another user.
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-motion-"))
    scratch.chmod(0o755)
    try:
        with concurrent.futures.ThreadPoolExecutor() as pool:
            turns = pool.submit(motion_long.turns, bench, ROOT, scratch) if bench.wants("turns") else None
            if bench.wants("matrix"):
                motion_matrix.measure(bench, ROOT, scratch)
            if bench.wants("estop"):
                motion_safety.estop_scan(bench, scratch)
                motion_safety.estop_reconstruction(bench, scratch)
            if bench.wants("killed"):
                motion_safety.killed(bench, scratch)
            if bench.wants("restarts"):
                motion_safety.restarts(bench, scratch)
            if bench.wants("words"):
                motion_long.words(bench, ROOT, scratch)
            if bench.wants("doctor"):
                motion_doctor.measure(bench, scratch)
            if turns:
                turns.result()
        if bench.wants("fuzz"):  # dozens of processes: not beside what is measured in milliseconds
            fuzz.measure(bench, ROOT, scratch, PARSERS)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
