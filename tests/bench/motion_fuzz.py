"""Parsers under libFuzzer: each target of tests/fuzz for ten minutes of processor time."""
import concurrent.futures
import re
import shutil
import subprocess

SECONDS, QUICK_SECONDS = 600, 10
BUILD_LIMIT_S = 900
PARSERS = {"grbl": "GRBL", "drive_profile": "profile files", "modbus_io": "Modbus I/O"}


def build(root, target="fuzzers"):
    """The targets (or one), built with clang; "" or why they are not there."""
    if shutil.which("clang++") is None:
        return "clang++ is not installed"
    for command in (["cmake", "--preset", "fuzz"], ["cmake", "--build", "--preset", "fuzz", "-j2", "--target", target]):
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=BUILD_LIMIT_S)
        if done.returncode != 0:
            return f"`{' '.join(command)}` failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}"
    return ""


def fuzz(bench, root, scratch, name):
    program = root / "build" / "fuzz" / "bin" / f"{name}_fuzz"
    if not program.is_file():
        return None
    corpus, grown = root / "tests" / "fuzz" / "corpus" / name, scratch / f"corpus-{name}"
    grown.mkdir()
    seconds = QUICK_SECONDS if bench.quick else SECONDS
    folders = [grown] + ([corpus] if corpus.is_dir() else [])
    return bench.run([program, *folders, f"-max_total_time={seconds}", f"-artifact_prefix={bench.out}/{name}-",
                      "-print_final_stats=1"], seconds + 120)


def measure(bench, root, scratch):
    asked = f"no crash in {QUICK_SECONDS if bench.quick else SECONDS} s"
    problem = build(root)
    with concurrent.futures.ThreadPoolExecutor(len(PARSERS)) as pool:
        ended = dict(zip(PARSERS, pool.map(lambda name: None if problem else fuzz(bench, root, scratch, name), PARSERS)))
    for name, done in ended.items():
        what = f"fuzzed: {PARSERS[name]}"
        if done is None:
            bench.line(what, asked, f"not measured: {problem or 'there is no such target'}", None)
            continue
        runs = re.search(r"number_of_executed_units: (\d+)", done.stderr)
        crash = re.search(r"SUMMARY: .*", done.stderr)
        bench.line(what, asked, f"{runs.group(1) if runs else '?'} inputs, {crash.group(0) if crash else 'no crash'}",
                   done.returncode == 0)
