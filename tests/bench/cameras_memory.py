"""An hour of preview and scanning at 10 frames/s: memory flat, no descriptor left."""
import json

HOUR_S, SAMPLED_S, QUICK_S = 3600, 600, 60
FLAT_KIB = 8192  # kept and reused by the allocator; 36,000 leaked frames of 160x120 would be 1.3 GiB


def slope_kib(samples):
    """Growth from the second to the last quarter of the time, by the mean of each: the first quarter warms up."""
    quarter = max(1, len(samples) // 4)
    mean = [sum(s["resident_kib"] for s in samples[i * quarter:(i + 1) * quarter]) / quarter for i in (1, 3)]
    return mean[1] - mean[0]


def measure(bench):
    time = bench.pick(full=HOUR_S, sampled=SAMPLED_S, quick=QUICK_S)
    what = f"{time // 60} min of preview and scanning at 10 frames/s: "
    done = bench.run([bench.bin / "camera_hour", time], time + 120)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    samples, ends = [line for line in lines if "at_s" in line], [line for line in lines if "before" in line]
    if done.returncode != 0 or len(samples) < 8 or not ends:
        measured = f"not measured: {(done.stderr or 'no answer').strip().splitlines()[-1]}"
        bench.line(what + "memory", "flat", measured, None if done.returncode == 77 else False)
        return
    last = samples[-1]
    bench.at_most(what + "memory, growth from the second to the last quarter", FLAT_KIB, slope_kib(samples), "KiB", 0)
    opened = {sample["descriptors"] for sample in samples[len(samples) // 4:]}
    bench.line(what + "descriptors", "the same all the time, all given back",
               f"{min(opened)} to {max(opened)}; {ends[0]['before']} before, {ends[0]['after']} after",
               len(opened) == 1 and ends[0]["before"] == ends[0]["after"])
    rate = (last["frames"] + last["previews"]) / last["at_s"]
    bench.line(what + "frames of each camera a second", "10", f"{rate:.1f} ({last['frames']} in scans, {last['previews']} "
               f"in previews, {last['failed']} views failed)", rate >= 9.0 and last["failed"] == 0)
