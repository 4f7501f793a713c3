#!/usr/bin/env python3
"""./dev profile [STAGE] [--scan DIR]: where a reconstruction spends its time, as a flame graph in out/profile.

One thread, so that every sample has its whole stack; perf samples it. Without STAGE the whole reconstruction; else what
lies below that stage's function. A scan is rendered once into out/profile/scan unless one is given.
"""
import argparse
import collections
import html
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
OUT = ROOT / "out" / "profile"
RATE_HZ = 49
STACK_BYTES = 32768  # windows of 31 px hold 12 kB on the stack
LIMIT_S = 1800
# Each stage of report.json, and the function below which it runs.
STAGES = {"range": "make_view", "watch": "RigWatch::add", "registration": "State::register_pose", "pose": "State::find_pose",
          "integration": "integrate", "texture": "texture_mesh", "writing": "write_model"}
WIDTH, ROW, SMALLEST = 1400, 17, 0.002  # px, px, share of the samples below which a box is left out


def arguments():
    parser = argparse.ArgumentParser(prog="./dev profile", description=__doc__.splitlines()[0])
    parser.add_argument("stage", nargs="?", choices=sorted(STAGES), metavar="STAGE", help=", ".join(sorted(STAGES)))
    parser.add_argument("--scan", type=pathlib.Path, help="folder of a scan")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    return parser.parse_args()


def run(command, **options):
    done = subprocess.run([str(word) for word in command], timeout=LIMIT_S, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"profile: {command[0]} ended with {done.returncode}: {(done.stderr or '').strip()[-300:]}")
    return done


def record(binaries, scan):
    data, model = OUT / "perf.data", OUT / "model"
    shutil.rmtree(model, ignore_errors=True)
    run(["perf", "record", "-q", "-F", RATE_HZ, "--call-graph", f"dwarf,{STACK_BYTES}", "-o", data, binaries / "scanrig",
         "reconstruct", scan, "--threads", "1", "--out", model], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return run(["perf", "script", "--no-inline", "-i", data, "-F", "ip,sym"], stdout=subprocess.PIPE,
               stderr=subprocess.DEVNULL).stdout


def name_of(symbol):
    """A function without arguments, namespaces of its own and templates."""
    symbol = re.sub(r"\(anonymous namespace\)::|scanrig::", "", symbol)
    while (shorter := re.sub(r"<[^<>]*>", "", symbol)) != symbol:
        symbol = shorter
    return symbol.partition("(")[0].split(" ")[-1] or symbol


def is_of_the_pool(symbol):
    """What only hands work on."""
    return any(word in symbol for word in ("tbb::", "parallel_for", "with_threads", "_Function_handler", "std::function",
                                                "[unknown]"))


def stacks_of(script):
    """Outermost function first."""
    for sample in script.split("\n\n"):
        frames = [line.strip().partition(" ")[2] for line in sample.splitlines() if line.strip()]
        names = [name_of(symbol) for symbol in reversed(frames) if symbol and not is_of_the_pool(symbol)]
        if names:
            yield names


def below(stacks, stage):
    if stage is None:
        yield from stacks
        return
    for names in stacks:
        at = [i for i, name in enumerate(names) if name == STAGES[stage] or name.endswith("::" + STAGES[stage])]
        if at:
            yield names[at[0]:]


def tree_of(stacks):
    root = {"samples": 0, "below": {}}
    for names in stacks:
        at = root
        at["samples"] += 1
        for name in names:
            at = at["below"].setdefault(name, {"samples": 0, "below": {}})
            at["samples"] += 1
    return root


def boxes(node, left, level, scale):
    """Left, level, width, name and samples of every box that is wide enough."""
    for name, child in sorted(node["below"].items(), key=lambda item: -item[1]["samples"]):
        width = child["samples"] * scale
        if width >= SMALLEST * WIDTH:
            yield left, level, width, name, child["samples"]
            yield from boxes(child, left, level + 1, scale)
        left += width


def svg_of(root, title):
    all_boxes = list(boxes(root, 0.0, 0, WIDTH / root["samples"]))
    height = ROW * (max(level for _, level, *_ in all_boxes) + 3)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" font-family="monospace" font-size="11">',
             f'<text x="4" y="13">{html.escape(title)}</text>']
    for left, level, width, name, samples in all_boxes:
        share, text = 100 * samples / root["samples"], html.escape(name)
        shown = html.escape(name[:int(width / 6.8)]) if width > 24 else ""
        lines.append(f'<g><title>{text}: {share:.1f} %</title><rect x="{left:.1f}" y="{ROW * (level + 1)}" width="{width:.1f}" '
                     f'height="{ROW - 1}" fill="hsl({20 + hash_of(name) % 35},80%,{62 + hash_of(name) % 13}%)"/>'
                     f'<text x="{left + 2:.1f}" y="{ROW * (level + 1) + 12}">{shown}</text></g>')
    return "\n".join([*lines, "</svg>", ""])


def hash_of(name):
    """The same in every run."""
    return sum((i + 1) * ord(letter) for i, letter in enumerate(name))


def print_largest(stacks):
    """Functions by the share of samples in which they appear."""
    counts = collections.Counter(name for names in stacks for name in set(names))
    for name, count in sorted(counts.items(), key=lambda item: -item[1])[:30]:
        print(f"{100 * count / len(stacks):6.1f} %  {name}")


def main():
    options = arguments()
    OUT.mkdir(parents=True, exist_ok=True)
    if shutil.which("perf") is None:
        sys.exit("profile: perf is not here: install linux-perf")
    scan = options.scan or OUT / "scan"
    if options.scan is None and not (scan / "scan.json").is_file():
        shutil.rmtree(scan, ignore_errors=True)
        run([options.bin / "scanrig-sim", "shoot", "--out", scan], stderr=subprocess.PIPE)
    stacks = list(below(stacks_of(record(options.bin, scan)), options.stage))
    if not stacks:
        sys.exit(f"profile: no sample lies in the stage {options.stage}")
    file = OUT / f"{options.stage or 'whole'}.svg"
    file.write_text(svg_of(tree_of(stacks), f"{options.stage or 'whole reconstruction'}, one thread, {len(stacks)} samples"))
    print_largest(stacks)
    print(file.relative_to(ROOT))


if __name__ == "__main__":
    main()
