#!/usr/bin/env python3
"""Makes the images of docs/guide/calibrate.md: python3 docs/images/calibration_images.py --bin build/release/bin

A rig drawn at random is calibrated from rendered board images, with three placements and with all seven. Drawings come
from its calibration.html. About ten minutes on two cores; the same programs give the same images.
"""
import argparse
import json
import pathlib
import re
import struct
import subprocess
import tempfile
import zlib

HERE = pathlib.Path(__file__).resolve().parent
RIG = ["--rig-seed", "5", "--seed", "5", "--rig", "noise=1"]
RIM_DOTS = ["--rim-dots", "40x84.5x2.4"]
FEW = ["1", "2", "7"]  # the fewest that are solved and graded
COLUMNS = 4            # of the placements' images
GAP, TEXT_PX = 12, 18


def run(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(file, rows):
    """`rows`: lists of (r, g, b)."""
    raw = b"".join(b"\0" + bytes(value for pixel in row for value in pixel) for row in rows)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) +
                     chunk(b"IEND", b""))


def unfilter(kind, line, above):
    """One row of a PNG with a byte a pixel [PNG specification, section 9.2]."""
    out = bytearray(line)
    for i, value in enumerate(line):
        left, up = out[i - 1] if i else 0, above[i]
        corner = above[i - 1] if i else 0
        if kind == 4:
            guess = left + up - corner
            predicted = min((left, up, corner), key=lambda near: abs(guess - near))
        else:
            predicted = (0, left, up, (left + up) // 2)[kind]
        out[i] = (value + predicted) & 255
    return out


def read_bayer(file):
    """Colour rows of a BayerRG8 image, at half its size."""
    data, at, packed = file.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        content = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height = struct.unpack(">II", content[:8])
        packed += content if kind == b"IDAT" else b""
        at += length + 12
    raw, above, rows = zlib.decompress(packed), bytes(width), []
    for y in range(height):
        begin = y * (width + 1)
        above = unfilter(raw[begin], raw[begin + 1:begin + 1 + width], above)
        rows.append(above)
    return [[(top[x], (top[x + 1] + below[x]) // 2, below[x + 1]) for x in range(0, width, 2)]
            for top, below in zip(rows[::2], rows[1::2])]


def placements_image(programs, scratch, file):
    """What the left camera sees of each placement, facing its mark."""
    folder = scratch / "placements"
    run(programs / "scanrig-sim", "shoot-board", "--out", folder, "--scale", "0.5", "--angles", "1", "--exact", "--no-noise")
    tiles = [read_bayer(image) for image in sorted(folder.glob("placement?_01_left.png"))]
    white = [(255, 255, 255)] * len(tiles[0][0])
    while len(tiles) % COLUMNS:
        tiles.append([white] * len(tiles[0]))
    rows = []
    for first in range(0, len(tiles), COLUMNS):
        rows += [sum(line, []) for line in zip(*tiles[first:first + COLUMNS])]
    write_png(file, rows)


def drawings(page, heading):
    """(svg, caption) of each figure below a heading of calibration.html."""
    part = next(part for part in re.split(r"(?=<h[23]>)", page) if part.startswith(f"<h3>{heading}<"))
    return re.findall(r"<figure[^>]*>\s*(<svg.*?</svg>)\s*<figcaption>(.*?)</figcaption>", part, re.DOTALL)


def write_svg(file, page, figures):
    """Drawings side by side, each under its caption."""
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL).group(1)
    rules = "\n".join(rule for rule in style.splitlines() if rule.startswith("svg"))
    x, height, body = 0.0, 0.0, ""
    for svg, caption in figures:
        size = [float(value) for value in re.match(r'<svg width="([\d.]+)" height="([\d.]+)"', svg).groups()]
        body += f'<text x="{x + 2}" y="{TEXT_PX - 5}">{caption}</text>\n'
        body += svg.replace("<svg ", f'<svg x="{x}" y="{TEXT_PX}" ', 1) + "\n"
        x, height = x + size[0] + GAP, max(height, size[1] + TEXT_PX)
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="{x - GAP}" height="{height}">\n<style>\n{rules}\n'
                    f'text{{font:12px system-ui,sans-serif}}\n</style>\n<rect width="100%" height="100%" fill="#fff"/>\n'
                    f"{body}</svg>\n")


def calibrated(programs, folder, placements):
    """calibration.html, and what --json prints."""
    options = ["--placements", *placements] if placements else []
    run(programs / "scanrig-sim", "shoot-board", "--out", folder, *RIG, *options)
    result = json.loads(run(programs / "scanrig", "calibrate", folder, "--out", folder / "calibration.json", "--json",
                            *RIM_DOTS))
    return (folder / "calibration.html").read_text(), result


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    programs = parser.parse_args().bin.resolve()
    with tempfile.TemporaryDirectory() as name:
        scratch = pathlib.Path(name)
        placements_image(programs, scratch, HERE / "calibration-placements.png")
        few, of_few = calibrated(programs, scratch / "few", FEW)
        page, of_all = calibrated(programs, scratch / "all", [])
    write_svg(HERE / "calibration-coverage.svg", page, drawings(page, "The images")[:1])
    write_svg(HERE / "calibration-residuals.svg", page, drawings(page, "Placement 1, in A")[:4])
    before, after = drawings(few, "By height y and radius r")[0], drawings(page, "By height y and radius r")[0]
    write_svg(HERE / "calibration-sigma.svg", page,
              [(before[0], f"placements {', '.join(FEW)}: grade {of_few['grade']}, {of_few['volume_um']:.1f} um"),
               (after[0], f"all seven: grade {of_all['grade']}, {of_all['volume_um']:.1f} um")])


if __name__ == "__main__":
    main()
