"""Cameras and the USB projector: triggers against frames on the wire, overhead, fault matrix, memory, fuzzed
replies, Debian 13."""
import concurrent.futures
import json
import pathlib
import shutil
import tempfile

import cameras_debian13
import cameras_memory
import cameras_wire
import fuzz
import motion_matrix
import virtual_machine

PARTS = ("triggers", "matrix", "wire", "hil", "debian13", "memory", "fuzz")
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TRIGGERS, QUICK_TRIGGERS = 10000, 1000


def triggers(bench):
    count = QUICK_TRIGGERS if bench.quick else TRIGGERS
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
    bench.line(what + "every one named and redone",
               f"{happened}: {lost + late} missing, {torn} torn, {stale} old", named,
               seen["named"] >= happened)
    bench.at_most("arming and collecting one exposure over the wire, p95", 50, seen["overhead_p95_ms"], "ms")


def measure(bench):
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="scanrig-cameras-"))
    try:
        # What takes an hour runs beside the rest: that has to hold on a busy machine too.
        with concurrent.futures.ThreadPoolExecutor() as pool:
            hour = pool.submit(cameras_memory.measure, bench) if bench.wants("memory") else None
            if bench.wants("triggers"):
                triggers(bench)
            if bench.wants("matrix"):
                motion_matrix.measure(bench, ROOT, scratch, cameras=True)
            if bench.wants("wire"):
                cameras_wire.measure(bench)
            if bench.wants("hil"):
                virtual_machine.measure(bench)
            if bench.wants("debian13"):
                cameras_debian13.measure(bench)
            if bench.wants("fuzz"):
                fuzz.measure(bench, ROOT, scratch,
                             [fuzz.Parser("dlpc350", "LightCrafter 4500 replies", processes=bench.cores)])
            if hour:
                hour.result()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
