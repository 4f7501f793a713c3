"""Lines of the virtual machine: ./dev hil, run as by a person, with new images and with cached ones."""
import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LIMIT_S = 1500


def measure(bench):
    if bench.long and not bench.quick:
        rows(bench, "images made", "--cold")
    rows(bench, "images cached")


def rows(bench, which, *options):
    packages = bench.run(["./dev", "deps", "hil"], LIMIT_S, cwd=ROOT)
    if packages.returncode != 0:
        bench.line(f"virtual machine, {which}", "its rows", f"not measured: {packages.stderr.strip()[-200:]}", None)
        return
    written = ROOT / "out" / "hil.json"
    written.unlink(missing_ok=True)
    done = bench.run(["python3", ROOT / "tests" / "hil" / "hil.py", "--bin", bench.bin, *options], LIMIT_S)
    if not written.is_file():
        bench.line(f"virtual machine, {which}", "its rows", f"none: {done.stderr.strip()[-200:]}", False)
        return
    for line in json.loads(written.read_text()):
        bench.line(f"virtual machine, {which}: {line['what']}", line["asked"], line["measured"], line["ok"])
