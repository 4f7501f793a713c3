"""The whole build and every test on a bare Debian 13."""
import re

import bare_machine
import debian13


def measure(bench):
    what, asked = "./dev debian13: the build and every test on a bare Debian 13", "all pass"
    reason = "not measured: --quick" if bench.quick else bare_machine.why_not()
    if reason:
        bench.line(what, asked, reason, None)
        return
    done = bench.run(debian13.command(["test"]), 7200)
    summary = [line for line in done.stdout.splitlines() if "tests passed" in line]
    failed = re.findall(r"^\s*\d+ - (\w+) \(\w+\)", done.stdout, re.MULTILINE)
    problem = (done.stderr.strip() or done.stdout.strip() or "no answer").splitlines()[-1]
    bench.line(what, asked, ", ".join(summary[-1:] + failed) or problem, done.returncode == 0)
