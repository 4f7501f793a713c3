"""Cost of storing during a scan: how long the table is stopped between a view's last frame and the next move.

The time includes everything the daemon does between two views, so encoding and syncing add no more than that.
"""
import statistics

LIMIT_MS, LIMIT_S = 20, 900


def measure(bench, scratch):
    what = "a view's disk cost that the move does not hide, p95"
    home = scratch / "view_cost"
    home.mkdir(parents=True, exist_ok=True)
    done = bench.run([bench.bin / "station_view_cost", home, bench.pick(full=8, sampled=3, quick=2)], LIMIT_S)
    stood = sorted(float(line) for line in done.stdout.split())
    if done.returncode != 0 or not stood:
        bench.note(done.stderr.strip())
        bench.at_most(what, LIMIT_MS, None, "ms")
        return
    bench.note(f"{len(stood)} views: median {statistics.median(stood):.1f} ms, longest {stood[-1]:.1f} ms")
    bench.at_most(what, LIMIT_MS, stood[min(len(stood) - 1, int(0.95 * len(stood)))], "ms", 1)
