"""Motion, light, panel: faults on the wire, emergency stop, restarts, long runs, the doctor, fuzzed parsers."""
import pathlib

import fuzz
import motion_doctor
import motion_doctor_sight
import motion_latch
import motion_long
import motion_matrix
import motion_safety
import motion_tools

PARSERS = [fuzz.Parser("grbl", "GRBL"), fuzz.Parser("drive_profile", "profile files"),
           fuzz.Parser("modbus_io", "Modbus I/O", processes=48)]
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def estop(bench, scratch):
    motion_safety.estop_scan(bench, scratch)
    motion_safety.estop_reconstruction(bench, scratch)


def doctor(bench, scratch):
    motion_doctor.measure(bench, scratch)
    motion_doctor_sight.measure(bench, scratch)


PARTS = {"matrix": lambda bench, scratch: motion_matrix.measure(bench, ROOT, scratch),
         "estop": estop,
         "killed": motion_safety.killed,
         "restarts": motion_safety.restarts,
         "latches": motion_latch.latches,
         "tools": motion_tools.moments,
         "turns": lambda bench, scratch: motion_long.turns(bench, ROOT, scratch),
         "words": lambda bench, scratch: motion_long.words(bench, ROOT, scratch),
         "doctor": doctor,
         "fuzz": lambda bench, scratch: fuzz.measure(bench, ROOT, scratch, PARSERS)}
BESIDE = ("turns",)
ALONE = ("fuzz",)  # dozens of processes: not beside measurements in milliseconds
