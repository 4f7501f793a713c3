#!/usr/bin/env python3
"""Makes the drawings of docs/guide/wiring.md: python3 docs/images/wiring.py

Each drawing is data: blocks with terminals on their left and right side, and wires between terminals. Columns are laid
out from left to right; a wire runs in a lane of its own between two columns.
"""
import html
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
BLOCK_W, ROW, HEAD, GAP_X, GAP_Y, MARGIN = 216, 24, 30, 110, 26, 16
COLOURS = {"24 V": "#b3261e", "signal": "#0b5cad", "safety": "#7a4f00", "light": "#00704e", "data": "#6a3fa0"}

# name: (title, columns of blocks, wires). A block: (name, terminals left, terminals right).
# A wire: ("block.terminal", "block.terminal", kind).
DRAWINGS = {
    "wiring-safety": (
        "E-stop, guard and drive: the relay cuts the motor's power, the software only watches",
        [[("24 V supply", [], ["+24 V"])],
         [("E-stop, two contacts", ["in"], ["channel 1", "channel 2"]),
          ("Guard, two contacts", ["in"], ["channel 1", "channel 2"])],
         [("Safety relay", ["e-stop 1", "e-stop 2", "guard 1", "guard 2"], ["safe out", "e-stop ok", "guard ok"])],
         [("Drive", ["STO, or motor power"], []), ("PC, isolated inputs", ["ESTOP_OK", "GUARD_OK"], [])]],
        [("24 V supply.+24 V", "E-stop, two contacts.in", "24 V"),
         ("24 V supply.+24 V", "Guard, two contacts.in", "24 V"),
         ("E-stop, two contacts.channel 1", "Safety relay.e-stop 1", "safety"),
         ("E-stop, two contacts.channel 2", "Safety relay.e-stop 2", "safety"),
         ("Guard, two contacts.channel 1", "Safety relay.guard 1", "safety"),
         ("Guard, two contacts.channel 2", "Safety relay.guard 2", "safety"),
         ("Safety relay.safe out", "Drive.STO, or motor power", "safety"),
         ("Safety relay.e-stop ok", "PC, isolated inputs.ESTOP_OK", "signal"),
         ("Safety relay.guard ok", "PC, isolated inputs.GUARD_OK", "signal")]),
    "wiring-trigger": (
        "Trigger: one edge fires a light and both cameras; a one-shot ends the light",
        [[("PC, GPIO module", [], ["PROJ_TRIG", "PROJ_PLAIN"])],
         [("Opto-coupler, 5 V", ["pattern", "plain"], ["pattern out", "plain out"])],
         [("One-shot, at most 50 ms", ["pattern", "plain"], ["pattern out", "plain out"]),
          ("OR gate", ["a", "b"], ["trigger"])],
         [("Pattern projector", ["trigger"], []), ("Plain light", ["trigger"], []),
          ("Left camera", ["Line0"], []), ("Right camera", ["Line0"], [])]],
        [("PC, GPIO module.PROJ_TRIG", "Opto-coupler, 5 V.pattern", "signal"),
         ("PC, GPIO module.PROJ_PLAIN", "Opto-coupler, 5 V.plain", "signal"),
         ("Opto-coupler, 5 V.pattern out", "One-shot, at most 50 ms.pattern", "signal"),
         ("Opto-coupler, 5 V.plain out", "One-shot, at most 50 ms.plain", "signal"),
         ("Opto-coupler, 5 V.pattern out", "OR gate.a", "signal"),
         ("Opto-coupler, 5 V.plain out", "OR gate.b", "signal"),
         ("One-shot, at most 50 ms.pattern out", "Pattern projector.trigger", "light"),
         ("One-shot, at most 50 ms.plain out", "Plain light.trigger", "light"),
         ("OR gate.trigger", "Left camera.Line0", "signal"),
         ("OR gate.trigger", "Right camera.Line0", "signal")]),
    "wiring-strobe": (
        "camera-strobe: outputs of the left camera, active while it exposes",
        [[("Left camera", [], ["Line1", "Line2"])],
         [("OR gate", ["a", "b"], ["trigger"]), ("Pattern projector", ["trigger"], []), ("Plain light", ["trigger"], [])],
         [("Right camera", ["Line0"], [])]],
        [("Left camera.Line1", "Pattern projector.trigger", "light"),
         ("Left camera.Line2", "Plain light.trigger", "light"),
         ("Left camera.Line1", "OR gate.a", "light"),
         ("Left camera.Line2", "OR gate.b", "light"),
         ("OR gate.trigger", "Right camera.Line0", "signal")]),
    "wiring-bus": (
        "RS-485: one line from end to end; 120 ohm at both ends, one bias",
        [[("Adapter, 120 ohm, bias", [], ["A", "B", "ground"])],
         [("I/O module", ["A", "B", "ground"], ["A out", "B out", "ground out"])],
         [("Drive", ["A", "B", "ground"], ["A out", "B out"])],
         [("120 ohm", ["A", "B"], [])]],
        [("Adapter, 120 ohm, bias.A", "I/O module.A", "data"),
         ("Adapter, 120 ohm, bias.B", "I/O module.B", "data"),
         ("Adapter, 120 ohm, bias.ground", "I/O module.ground", "data"),
         ("I/O module.A out", "Drive.A", "data"),
         ("I/O module.B out", "Drive.B", "data"),
         ("I/O module.ground out", "Drive.ground", "data"),
         ("Drive.A out", "120 ohm.A", "data"),
         ("Drive.B out", "120 ohm.B", "data")]),
    "wiring-panel": (
        "Panel: buttons to inputs, outputs through drivers to 24 V lamps",
        [[("24 V supply", [], ["+24 V"])],
         [("Buttons, normally open", ["in"], ["Start", "Reset", "Stop"])],
         [("Inputs, opto-isolated", ["START", "RESET", "STOP"], []), ("Outputs, 0.5 A", [], ["RED", "AMBER", "GREEN", "START_LAMP"])],
         [("Lamps, 24 V", ["red", "amber", "green", "in Start"], [])]],
        [("24 V supply.+24 V", "Buttons, normally open.in", "24 V"),
         ("Buttons, normally open.Start", "Inputs, opto-isolated.START", "signal"),
         ("Buttons, normally open.Reset", "Inputs, opto-isolated.RESET", "signal"),
         ("Buttons, normally open.Stop", "Inputs, opto-isolated.STOP", "signal"),
         ("Outputs, 0.5 A.RED", "Lamps, 24 V.red", "24 V"),
         ("Outputs, 0.5 A.AMBER", "Lamps, 24 V.amber", "24 V"),
         ("Outputs, 0.5 A.GREEN", "Lamps, 24 V.green", "24 V"),
         ("Outputs, 0.5 A.START_LAMP", "Lamps, 24 V.in Start", "24 V")]),
}


class Layout:
    """Where blocks and terminals of a drawing are."""

    def __init__(self, columns):
        self.boxes, self.terminals, self.height = [], {}, 0
        for number, blocks in enumerate(columns):
            x, y = MARGIN + number * (BLOCK_W + GAP_X), MARGIN + 2 * ROW
            for name, left, right in blocks:
                height = HEAD + ROW * max(len(left), len(right), 1)
                self.boxes.append((x, y, height, name, left, right))
                for side, names in ((0, left), (1, right)):
                    for row, terminal in enumerate(names):
                        place = (x + side * BLOCK_W, y + HEAD + ROW * (row + 0.5), number, side)
                        self.terminals[f"{name}.{terminal}"] = place
                y += height + GAP_Y
            self.height = max(self.height, y)
        self.width = 2 * MARGIN + len(columns) * BLOCK_W + (len(columns) - 1) * GAP_X


def text(x, y, words, anchor="start", style=""):
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}"{style}>{html.escape(words)}</text>\n'


def lanes(layout, wires):
    """A lane in the gap right of its column for each source terminal, by the height of where its wires go."""
    sources = {}
    for source, target, _ in wires:
        column = layout.terminals[source][2]
        sources.setdefault(column, {}).setdefault(source, []).append(layout.terminals[target][1])
    places = {}
    for of_column in sources.values():
        falling = sorted((s for s in of_column if max(of_column[s]) >= layout.terminals[s][1]),
                         key=lambda s: -layout.terminals[s][1])
        rising = sorted((s for s in of_column if s not in falling), key=lambda s: layout.terminals[s][1])
        for number, source in enumerate([*falling, *rising]):
            places[source] = (number + 1) / (len(of_column) + 1)
    return places


def drawing(title, columns, wires):
    layout = Layout(columns)
    width, height = layout.width, layout.height + ROW
    body = text(MARGIN, MARGIN + ROW / 2, title, style=' font-weight="600"')
    of_lane = lanes(layout, wires)
    for source, target, kind in wires:
        x1, y1, _, _ = layout.terminals[source]
        x2, y2, _, _ = layout.terminals[target]
        lane = x1 + GAP_X * of_lane[source]
        colour = COLOURS[kind]
        body += f'<path d="M{x1:g} {y1:g}H{lane:g}V{y2:g}H{x2:g}" fill="none" stroke="{colour}" stroke-width="2"/>\n'
        body += f'<circle cx="{x2:g}" cy="{y2:g}" r="3" fill="{colour}"/>\n'
    for x, y, tall, name, left, right in layout.boxes:
        body += f'<rect x="{x:g}" y="{y:g}" width="{BLOCK_W}" height="{tall}" rx="4" fill="#f4f6f8" stroke="#51606e"/>\n'
        body += text(x + BLOCK_W / 2, y + 20, name, "middle", ' font-weight="600"')
        for row, terminal in enumerate(left):
            body += text(x + 8, y + HEAD + ROW * (row + 0.5) + 5, terminal)
        for row, terminal in enumerate(right):
            body += text(x + BLOCK_W - 8, y + HEAD + ROW * (row + 0.5) + 5, terminal, "end")
    used = list(dict.fromkeys(kind for _, _, kind in wires))
    for number, kind in enumerate(used):
        x, y = MARGIN + 130 * number, layout.height + 4
        body += f'<path d="M{x} {y:g}h28" stroke="{COLOURS[kind]}" stroke-width="2"/>\n' + text(x + 34, y + 5, kind)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" '
            f'viewBox="0 0 {width:g} {height:g}" font-family="system-ui,sans-serif" font-size="14">\n'
            f'<rect width="100%" height="100%" fill="#fff"/>\n{body}</svg>\n')


def main():
    for name, (title, columns, wires) in DRAWINGS.items():
        (HERE / f"{name}.svg").write_text(drawing(title, columns, wires))


if __name__ == "__main__":
    main()
