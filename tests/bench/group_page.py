"""The page in Debian's Chromium: what a person does, attacks, bars, the bundle; the guides; the packages."""
import filecmp
import gzip
import json
import pathlib
import time

import package_arm64
import page_guide
import page_package

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BROWSER = ROOT / "tests" / "browser"
SCENE_S, BARS_S = 420, 900
FIRST, THREE = ("index.html", "main-"), ("chunk-", "viewer-", "live-")
LIMITS_KB = {"first load": 70, "3D": 220, "all": 350}


def why_not():
    if not pathlib.Path("/usr/bin/chromium").exists():
        return "no /usr/bin/chromium"
    return None if (ROOT / "web" / "node_modules").is_dir() else "no web/node_modules: ./dev web build"


def scenes(bench, scratch):
    """Each scene is a line; the list is the program's own."""
    if reason := why_not():
        bench.line("the page in a browser", "all scenes", reason, None)
        return
    begun = time.monotonic()
    done = bench.run(["node", BROWSER / "scenarios.mjs", bench.bin], SCENE_S)
    if done.returncode == 77:
        bench.line("the page in a browser", "all scenes", done.stdout.strip(), None)
        return
    told = [line.split(maxsplit=1) for line in done.stdout.splitlines() if line.startswith(("ok ", "FAIL "))]
    for ok, rest in told:
        bench.line(f"scene {rest.split(',')[0].split(':')[0]}", "as it should be", rest[:160], ok == "ok")
    bench.line("all scenes of the page", "end", f"{len(told)} of them, exit code {done.returncode}",
               done.returncode == 0 and bool(told))
    bench.at_most("all scenes of the page: time", 4, (time.monotonic() - begun) / 60, "min", digits=1)


def bars(bench, scratch):
    if reason := why_not():
        bench.line("bars of the page", "measured", reason, None)
        return
    done = bench.run(["node", BROWSER / "bars.mjs", bench.bin], BARS_S)
    for line in done.stdout.splitlines():
        bar = json.loads(line)
        bench.at_most(bar["what"], bar["limit"], bar["value"], bar["unit"], digits=1 if bar["unit"] == "%" else 0)
    bench.line("bars of the page", "measured to the end", done.stderr.strip()[-200:] or "yes", done.returncode == 0)


def bundle(bench, scratch):
    if reason := why_not():
        bench.line("bundle of the page", "measured", reason, None)
        return
    folders = [scratch / "bundle1", scratch / "bundle2"]
    begun = time.monotonic()
    for folder in folders:
        bench.run(["node", ROOT / "web" / "build.mjs", folder], 120, cwd=ROOT / "web", check=True)
        if folder == folders[0]:
            bench.at_most("bundle of the page: build", 20, time.monotonic() - begun, "s", digits=1)
    files = sorted(path.relative_to(folders[0]) for path in folders[0].rglob("*") if path.is_file())
    _, other, missing = filecmp.cmpfiles(*folders, files, shallow=False)
    bench.line("bundle of the page: built twice", "same bytes", f"{len(files)} files, {len(other) + len(missing)} differ",
               bool(files) and not other and not missing)
    size = {path: len(gzip.compress((folders[0] / path).read_bytes())) / 1000 for path in files if path.suffix != ".gz"}
    shares = {"first load": [path for path in size if path.name.startswith(FIRST)],
              "3D": [path for path in size if path.name.startswith(THREE)], "all": list(size)}
    for name, limit in LIMITS_KB.items():
        bench.at_most(f"bundle of the page, gzip: {name}", limit, sum(size[path] for path in shares[name]), "kB", digits=0)


PARTS = {"scenes": scenes, "bars": bars, "bundle": bundle, "guide": page_guide.measure, "package": page_package.measure,
         "arm64": package_arm64.measure}
