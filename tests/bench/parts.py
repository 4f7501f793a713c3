"""Runs the parts of a group, with the time of each as a line of its own."""
import concurrent.futures
import pathlib
import shutil
import tempfile
import time
import traceback

import budget


def time_line(bench, what, timeout_min, minutes):
    """True or False by the budget; only reported where there is none."""
    measured = f"{minutes:.1f} min on {bench.cores} cores"
    if timeout_min is None:
        bench.line(what, "reported", measured, True)
    elif bench.cores < budget.CORES:
        bench.line(what, f"<= {timeout_min} min on {budget.CORES} cores", f"not measured: {measured}", None)
    else:
        bench.line(what, f"<= {timeout_min} min on {budget.CORES} cores", measured, minutes <= timeout_min)


def run_part(bench, name, measure, scratch):
    if bench.seconds_left() <= 0:
        bench.line(f"part {name}", "measured", f"not run: the {budget.LIMIT_MIN} minutes of the group are over", False)
        return
    begun = time.monotonic()
    try:
        measure(bench, scratch)
    except Exception as error:  # a part that fails does not affect the lines of others
        traceback.print_exc()
        bench.line(f"part {name}", "measured", f"ended early: {type(error).__name__}: {error}", False)
    if not bench.quick:
        timeout_min = None if bench.long else budget.MINUTES[bench.group][name]
        time_line(bench, f"part {name}: time", timeout_min, (time.monotonic() - begun) / 60)


def run_group(bench, group, module):
    """Runs every requested part, in order. With --long those of module.BESIDE run beside the others, but not beside
    those of module.ALONE."""
    wanted = [name for name in module.PARTS if bench.wants(name) and budget.runs(group, name, bench.long)]
    beside = [name for name in wanted if bench.long and name in getattr(module, "BESIDE", ())]
    alone = getattr(module, "ALONE", ())
    bench.begin_group(group)
    # Short paths: the name of a Unix socket has 107 characters. Readable: the doctor also runs as another user.
    scratch = pathlib.Path(tempfile.mkdtemp(prefix=f"scanrig-{group}-"))
    scratch.chmod(0o755)
    begun = time.monotonic()
    try:
        with concurrent.futures.ThreadPoolExecutor() as pool:
            running = [pool.submit(run_part, bench, name, module.PARTS[name], scratch) for name in beside]
            for name in wanted:
                if name in alone:
                    concurrent.futures.wait(running)
                if name not in beside:
                    run_part(bench, name, module.PARTS[name], scratch)
            for part in running:
                part.result()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    if not bench.only and not bench.quick:
        time_line(bench, "all parts: time", None if bench.long else budget.LIMIT_MIN, (time.monotonic() - begun) / 60)
    left = [name for name in module.PARTS if name not in wanted and bench.wants(name)]
    if left:
        bench.note(f"with --long only: {', '.join(left)}")
