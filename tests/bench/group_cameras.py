"""Cameras and the USB projector: triggers against frames on the wire, overhead, fault matrix, memory, fuzzed
replies, Debian 13."""
import json
import pathlib

import cameras_debian13
import cameras_memory
import cameras_wire
import fuzz
import motion_matrix
import virtual_machine

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def triggers(bench, _scratch):
    count = bench.pick(full=10000, sampled=2000, quick=1000)
    what = f"{count} triggers with 1 % lost, 1 % late, 1 % torn, 0.5 % stale: "
    done = bench.run([bench.bin / "triggers", count], count // 10 + 120)
    if done.returncode != 0:
        measured = f"not measured: {(done.stderr or 'no answer').strip().splitlines()[-1]}"
        bench.line(what + "mismatched or old pairs used", "0", measured, None if done.returncode == 77 else False)
        return
    seen = json.loads(done.stdout.strip().splitlines()[-1])
    lost, late, torn, stale = (int(word) for word in seen["happened"].split())
    bench.line(what + "mismatched or old pairs used", "0", str(seen["wrong"]),
               seen["wrong"] == 0 and seen["good"] == count)
    happened = lost + late + torn + stale
    named = f"{seen['named']}: {seen['lost']} missing, {seen['torn']} torn, {seen['old']} old, {seen['odd']} other"
    bench.line(what + "every one named and retaken",
               f"{happened}: {lost + late} missing, {torn} torn, {stale} old", named,
               seen["named"] >= happened)
    bench.at_most("arming and collecting one exposure over the wire, p95", 50, seen["overhead_p95_ms"], "ms")


def fuzzed(bench, scratch):
    fuzz.measure(bench, ROOT, scratch, [fuzz.Parser("dlpc350", "LightCrafter 4500 replies", processes=bench.cores)])


PARTS = {"triggers": triggers,
         "matrix": lambda bench, scratch: motion_matrix.measure(bench, ROOT, scratch, cameras=True),
         "wire": lambda bench, _: cameras_wire.measure(bench),
         "hil": lambda bench, _: virtual_machine.measure(bench),
         "debian13": lambda bench, _: cameras_debian13.measure(bench),
         "memory": lambda bench, _: cameras_memory.measure(bench),
         "fuzz": fuzzed}
BESIDE = ("memory",)  # an hour: it must also hold on a busy machine
