"""Parsers under libFuzzer: each target of tests/fuzz for ten minutes of processor time."""
import concurrent.futures
import os
import re
import shutil
import signal
import subprocess
import time

CPU_S, QUICK_CPU_S = 600, 5
WALL_LIMIT_S = 3600
BUILD_LIMIT_S = 3600
LOOK_S = 0.5
HANG_S = 60  # for one input, on an overloaded machine
CRASH = re.compile(r"SUMMARY: .*")
INPUT = re.compile(r"Test unit written to \S*/(\S+)(?:\nBase64: (\S+))?")  # short inputs in base64 too
TICKS = os.sysconf("SC_CLK_TCK")


class Parser:
    """A target, the text for its input, and the number of processes that share its work: more where it mostly waits."""

    def __init__(self, target, words, processes=1):
        self.target, self.words, self.processes = target, words, processes


def build(root, parsers):
    """The targets, built with clang; "" or why they are missing."""
    if shutil.which("clang++") is None:
        return "clang++ is not installed"
    targets = [f"{parser.target}_fuzz" for parser in parsers]
    for command in (["cmake", "--preset", "fuzz"],
                    ["cmake", "--build", "--preset", "fuzz", "-j2", "--target", *targets]):
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=BUILD_LIMIT_S)
        if done.returncode != 0:
            return f"`{' '.join(command)}` failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}"
    return ""


def cpu_s(process):
    """Processor seconds of a process that has not been waited for yet."""
    with open(f"/proc/{process.pid}/stat") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def crash_in(told):
    """Description of a crash by libFuzzer, and its input; "" without a crash."""
    found, kept = CRASH.search(told), INPUT.search(told)
    if not found:
        return ""
    words = [word for word in kept.groups() if word] if kept else ["not kept"]
    return f"{found.group(0)}; input: {' '.join(words)}"


def run(bench, root, scratch, parser):
    """Inputs tried, processor seconds, and a description of the first crash or ""."""
    wanted = QUICK_CPU_S if bench.quick else CPU_S
    grown, log = scratch / f"corpus-{parser.target}", scratch / f"{parser.target}-{{}}.log"
    grown.mkdir(parents=True)
    corpus = root / "tests" / "fuzz" / "corpus" / parser.target
    command = [root / "build" / "fuzz" / "bin" / f"{parser.target}_fuzz", grown, corpus, "-print_final_stats=1",
               f"-timeout={HANG_S}", f"-artifact_prefix={bench.out}/{parser.target}-"]
    logs = [open(str(log).format(n), "w+") for n in range(parser.processes)]
    crew = [subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=out,
                             preexec_fn=lambda: os.nice(19)) for out in logs]
    begun, spent = time.monotonic(), 0.0
    while spent < wanted and time.monotonic() - begun < WALL_LIMIT_S:
        time.sleep(LOOK_S)
        spent = sum(map(cpu_s, crew))
        if any(os.waitid(os.P_PID, one.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) for one in crew):
            break  # a process ends early only in a crash
    ended_early = [one.poll() is not None for one in crew]
    for one in crew:
        one.send_signal(signal.SIGINT)
    for one in crew:
        try:
            one.wait(60)
        except subprocess.TimeoutExpired:
            one.kill()
            one.wait()
    inputs, crash = 0, ""
    for out, early in zip(logs, ended_early):
        out.seek(0)
        told = out.read()
        out.close()
        counted = re.findall(r"(?:number_of_executed_units: |^#)(\d+)", told, re.MULTILINE)
        inputs += int(counted[-1]) if counted else 0
        crash = crash or crash_in(told) or ("ended by itself: " + told.strip()[-120:] if early else "")
    return inputs, spent, crash


def measure(bench, root, scratch, parsers):
    """One line per parser; all run at once."""
    wanted = QUICK_CPU_S if bench.quick else CPU_S
    asked = f"no crash in {wanted} s of processor time"
    problem = build(root, parsers)
    with concurrent.futures.ThreadPoolExecutor(len(parsers)) as pool:
        ended = [] if problem else list(pool.map(lambda parser: run(bench, root, scratch, parser), parsers))
    for number, parser in enumerate(parsers):
        if problem:
            bench.line(f"fuzzed: {parser.words}", asked, f"not measured: {problem}", None)
            continue
        inputs, spent, crash = ended[number]
        bench.line(f"fuzzed: {parser.words}", asked, f"{inputs} inputs in {spent:.0f} s, {crash or 'no crash'}",
                   not crash and spent >= wanted)
