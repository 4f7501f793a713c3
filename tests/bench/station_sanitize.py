"""The whole suite under each sanitizer."""
import pathlib
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SANITIZERS = {"asan": "address and undefined-behaviour sanitizers", "tsan": "thread sanitizer"}
LIMIT_S = 3 * 3600


def measure(bench, _scratch):
    for preset, name in SANITIZERS.items():
        what, asked = f"./dev sanitize: {name}, whole suite", "all pass, no report"
        if bench.quick:
            bench.line(what, asked, "not measured: --quick", None)
            continue
        begun = time.monotonic()
        done = bench.run([ROOT / "dev", "sanitize", preset], LIMIT_S)
        said = done.stdout.splitlines()
        wanted = ("tests passed", "== reports")
        summary = [line.removeprefix("== ") for line in said if any(word in line for word in wanted)]
        problem = (done.stderr.strip() or done.stdout.strip() or "no answer").splitlines()[-1]
        minutes = (time.monotonic() - begun) / 60
        bench.line(what, asked, f"{'; '.join(summary) or problem}; {minutes:.0f} min with the build", done.returncode == 0)
