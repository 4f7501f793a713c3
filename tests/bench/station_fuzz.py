"""External input of the station, under libFuzzer."""
import pathlib

import fuzz

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PARSERS = [fuzz.Parser("http_target", "HTTP targets"), fuzz.Parser("json_request", "JSON requests"),
           fuzz.Parser("rig_toml", "rig.toml"), fuzz.Parser("manifest", "scan.json"),
           fuzz.Parser("ply_mesh", "PLY"), fuzz.Parser("obj_mesh", "OBJ"), fuzz.Parser("stl_mesh", "STL"),
           fuzz.Parser("glb_mesh", "GLB")]


def measure(bench, scratch):
    fuzz.measure(bench, ROOT, scratch / "fuzz", PARSERS)
