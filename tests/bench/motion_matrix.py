"""The fault matrix: rows from the driver interfaces and the shipped drivers, columns what goes wrong on the wire."""
import json
import re

LIMIT_S = 900
WORKERS = 8  # the cells mostly wait
INTERFACES = {"Turntable": "drivers/turntable/turntable.h", "Projector": "drivers/projector/projector.h",
              "Panel": "drivers/panel/panel.h", "StereoCamera": "drivers/camera/stereo_camera.h"}
SHARED = {"AxisTurntable": "Turntable", "SensorCamera": "StereoCamera"}  # common base of several drivers
# Interfaces and drivers whose rows are the cameras group's.
CAMERAS = ("StereoCamera", "LightCrafterProjector", "CameraStrobeProjector")


def methods(root, interface):
    """Functions that the interface requires of every driver."""
    text = (root / INTERFACES[interface]).read_text()
    return re.findall(r"virtual [\w:<>, ]+? (\w+)\([^;]*\) (?:noexcept )?= 0;", text)


def shipped(root):
    """(interface, class) of every driver in drivers/."""
    for header in sorted((root / "drivers").rglob("*.h")):
        for name, base in re.findall(r"class (\w+) final : public (\w+)", header.read_text()):
            interface = SHARED.get(base, base)
            if interface in INTERFACES:
                yield interface, name


def devices(root, driver):
    """The variants of one driver class: a profile each of the Modbus turntable, a kind of sensor each of the camera."""
    if driver == "SensorCamera":
        return ["aravis", "v4l2", "v4l2-side-by-side"]
    if driver != "ModbusTurntable":
        return [""]
    return sorted(profile.stem for profile in (root / "config" / "drives").glob("*.toml"))


def rows(root, cameras):
    """Row of the cameras group, or of the motion group."""
    return [(name, device, method) for interface, name in shipped(root) if bool({interface, name} & set(CAMERAS)) == cameras
            for device in devices(root, name) for method in methods(root, interface)]


def write(path, wanted, cells, faults):
    lines = ["# Fault matrix", "", "`-` with a number: not applicable, for the reason below.", "",
             "| driver | call | " + " | ".join(faults) + " |", "|---|---|" + "---|" * len(faults)]
    reasons = {}
    for driver, device, method in wanted:
        fields = []
        for fault in faults:
            cell = cells.get((driver, device, method, fault))
            if cell is None:
                fields.append("**no cell**")
            elif not cell["applicable"]:
                fields.append(f"- {reasons.setdefault(cell['told'], len(reasons) + 1)}")
            else:
                end = cell["told"].split(":")[0]
                fields.append(end if cell["held"] else f"**{end}: {'; '.join(cell['wrongs'])}**")
        lines.append(f"| {driver} {device} | {method} | " + " | ".join(fields) + " |")
    lines += ["", *(f"{number}. {reason}" for reason, number in reasons.items()), ""]
    path.write_text("\n".join(lines))


def measure(bench, root, scratch, cameras=False):
    ports = scratch / "matrix"
    ports.mkdir(parents=True, exist_ok=True)
    done = bench.run([bench.bin / "fault_matrix", root / "config" / "drives", ports, WORKERS,
                      "cameras" if cameras else "motion"], LIMIT_S)
    cells, faults = {}, []
    for line in done.stdout.splitlines():
        cell = json.loads(line)
        cells[cell["driver"], cell["device"], cell["method"], cell["fault"]] = cell
        if cell["fault"] not in faults:
            faults.append(cell["fault"])
    wanted = rows(root, cameras)
    cells = {key: cell for key, cell in cells.items() if key[:3] in wanted}
    write(bench.out / "fault_matrix.md", wanted, cells, faults)
    missing = [row for row in wanted if any((*row, fault) not in cells for fault in faults)]
    tried = [cell for cell in cells.values() if cell["applicable"]]
    held = [cell for cell in tried if cell["held"]]
    bench.line("fault matrix: rows", "every call of every shipped driver", f"{len(wanted)} rows, {len(missing)} without "
               f"cells{': ' + ', '.join(sorted({' '.join(row[:2]) for row in missing})) if missing else ''}",
               bool(wanted) and not missing)
    bench.line("fault matrix: cells", "all hold", f"{len(held)} of {len(tried)} hold, {len(cells) - len(tried)} not "
               "applicable", bool(tried) and len(held) == len(tried))
    for cell in tried:
        if not cell["held"]:
            bench.note(f"{cell['driver']} {cell['device']} {cell['method']}, {cell['fault']}: {'; '.join(cell['wrongs'])}"
                       f" [{cell['told']}]")
    bench.line("fault matrix: hangs, wrong positions, crashes", "0, 0, 0",
               f"{sum(c['hung'] for c in tried)}, {sum(c['wrong_position'] for c in tried)}, "
               f"{int(done.returncode != 0)}",
               done.returncode == 0 and not any(c["hung"] or c["wrong_position"] for c in tried))
