"""The whole suite under a sanitizer; each sanitizer is its own part, since it takes about an hour on two cores."""
import pathlib
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LIMIT_S = 3 * 3600


class Suite:
    def __init__(self, preset, name):
        self.preset = preset
        self.name = name

    def measure(self, bench, _scratch):
        what, asked = f"./dev sanitize: {self.name}, whole suite", "all pass, no report"
        if bench.quick:
            bench.line(what, asked, "not measured: --quick", None)
            return
        begun = time.monotonic()
        done = bench.run([ROOT / "dev", "sanitize", self.preset], LIMIT_S)
        said = done.stdout.splitlines()
        wanted = ("tests passed", "== reports")
        summary = [line.removeprefix("== ") for line in said if any(word in line for word in wanted)]
        problem = (done.stderr.strip() or done.stdout.strip() or "no answer").splitlines()[-1]
        minutes = (time.monotonic() - begun) / 60
        bench.line(what, asked, f"{'; '.join(summary) or problem}; {minutes:.0f} min with the build", done.returncode == 0)


ASAN = Suite("asan", "address and undefined-behaviour sanitizers")
TSAN = Suite("tsan", "thread sanitizer")
