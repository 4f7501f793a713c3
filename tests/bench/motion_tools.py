"""Tools that move the table, each ended by signals and a pulled cable at random moments."""
import os
import re

PROGRAM = "moving_tools_test"
STANDSTILL_MS = 1000
LIMIT_S = 3000
ENDING = re.compile(r"^(.+): (SIGINT|SIGTERM|SIGKILL|cable) at (\d+) moments, (\d+) while moving; "
                    r"longest until standstill (\d+) ms$", re.MULTILINE)


def moments(bench, scratch):
    """The rules themselves (stop is the first frame, no motion after it, the lamp goes red) are the program's."""
    wanted = bench.pick(full=50, sampled=4, quick=2)
    done = bench.run([bench.test_program(PROGRAM), "--gtest_filter=ToolMoments.*"], LIMIT_S,
                     env={**os.environ, "SCANRIG_MOMENTS": str(wanted), "TMPDIR": str(scratch)})
    seen = ENDING.findall(done.stdout)
    for tool, way, count, moving, longest_ms in seen:
        ok = int(longest_ms) < STANDSTILL_MS and int(count) >= wanted and done.returncode == 0
        bench.line(f"{tool}, ended by {way}", f"standstill < {STANDSTILL_MS} ms at {wanted} moments",
                   f"longest {longest_ms} ms, {count} moments, {moving} while moving", ok)
    for failure in re.findall(r": Failure\n(.{1,600})", done.stdout, re.DOTALL)[:8]:
        bench.note(" ".join(failure.split()))
    bench.line("tools that move leave no table turning", "all tests pass",
               f"{len(seen)} tools and ways, {'all pass' if done.returncode == 0 else 'some FAIL'}",
               done.returncode == 0 and bool(seen))
