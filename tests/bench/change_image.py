"""A copy of a scan in which one image is changed, as stickers, shadows, fingers and reflections change it.

sticker: a patch in the screen's colour; tint: a patch that only the screen lights; shadow: a finger's; reflection: a
bright patch, all in a plain image; crept: the view is taken from another scan, in which the object stands elsewhere."""
import hashlib
import json
import math
import os
import random
import shutil

import grey_png

SOFT_PX = 3.0
SCREEN_ALBEDO = 0.5


def object_pixels(rows):
    """Top left corners of the squares of 2 x 2 (red top left, blue bottom right) that are not blue, nor any around."""
    def is_object(x, y):
        red, green, blue = rows[y][x], rows[y][x + 1], rows[y + 1][x + 1]
        return 2 * blue < red + green + blue and red > 8
    around = [(a, b) for a in (-12, 0, 12) for b in (-12, 0, 12)]
    return [(x, y) for y in range(14, len(rows) - 14, 2) for x in range(14, len(rows[0]) - 14, 2)
            if all(is_object(x + a, y + b) for a, b in around)]


def screen_values(rows):
    """Mean over the top of the image at the four places of the sensor's pattern."""
    top = rows[:len(rows) // 8 // 2 * 2]
    return [[sum(sum(row[x::2]) for row in top[y::2]) / (len(top) / 2 * len(rows[0]) / 2) for x in (0, 1)] for y in (0, 1)]


def changed(kind, own, screen, chance):
    if kind == "sticker":
        return screen[0] + chance.gauss(0, 1.5)
    if kind == "tint":
        return own * 0.9 * SCREEN_ALBEDO * screen[0] / screen[1]
    return 0.35 * own if kind == "shadow" else own + 170.0


def change(rows, kind, chance):
    """A disc of 6 to 12 % of the object's size, its middle on the object."""
    inside = object_pixels(rows)
    screen = screen_values(rows)
    middle_x, middle_y = chance.choice(inside)
    size = max(max(axis) - min(axis) for axis in zip(*inside))
    radius = chance.uniform(0.06, 0.12) * size
    reach = int(radius + SOFT_PX)
    for y in range(max(0, middle_y - reach), min(len(rows), middle_y + reach)):
        for x in range(max(0, middle_x - reach), min(len(rows[0]), middle_x + reach)):
            share = min(1.0, max(0.0, (radius - math.hypot(x - middle_x, y - middle_y)) / SOFT_PX + 0.5))
            own, of_screen = rows[y][x], (screen[y % 2][x % 2], screen[1][1])
            value = (1 - share) * own + share * changed(kind, own, of_screen, chance)
            rows[y][x] = round(min(255.0, max(0.0, value)))


def replace(scan, record, data):
    file = scan / record["path"]
    file.unlink()
    file.write_bytes(data)
    record["sha256"] = hashlib.sha256(data).hexdigest()


def copy(sound, scan, kind, view, camera, seed, other):
    """`scan`: the new folder; `other`: the scan that crept views are taken from."""
    shutil.copytree(sound, scan, copy_function=os.link, ignore=shutil.ignore_patterns("model", "scan.json"))
    manifest = json.loads((sound / "scan.json").read_text())
    files = manifest["poses"][0]["views"][view]["files"]
    if kind == "crept":
        for record in files.values():
            replace(scan, record, (other / record["path"]).read_bytes())
    else:
        record = files[f"{camera}_plain"]
        rows = grey_png.read((sound / record["path"]).read_bytes())
        change(rows, kind, random.Random(seed))
        replace(scan, record, grey_png.write(rows))
    (scan / "scan.json").write_text(json.dumps(manifest, indent=2))
