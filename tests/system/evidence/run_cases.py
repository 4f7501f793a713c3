"""run_cases.py CASES BIN SCRATCH: runs the cases of a module of tests/bench, exits 1 when one does not hold."""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "bench"))

import bad_input
import truth_absent

CASES = {"bad_input": lambda b, s: bad_input.cases(b, s, ROOT / "config" / "rigs" / "example.toml"),
         "truth_absent": lambda b, s: truth_absent.cases(b, s)}

name, binaries, scratch = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
held = []
for what, ok, seen in CASES[name](binaries, scratch):
    print(f"{'ok' if ok else 'NO'}  {what}: {seen}", flush=True)
    held.append(ok)
print(f"{held.count(True)} of {len(held)} hold")
sys.exit(0 if held and all(held) else 1)
