"""Operator of the simulated rig on the wire: actions of tests and users through its control socket."""
import json
import socket
import time

GLANCE_S = 0.1
TAP_S = 0.2  # like a hand; the panel debounces for 50 ms


class ControlClient:
    """Threads: one at a time, except operate(), which has its own connection."""

    def __init__(self, control):
        self.control = control
        self.connect()

    def connect(self):
        self.peer = socket.socket(socket.AF_UNIX)
        self.peer.connect(str(self.control))
        self.lines = self.peer.makefile("r")

    def request(self, **request):
        """Sends one request; raises RuntimeError with the rig's message when the rig rejects it."""
        self.peer.sendall((json.dumps(request) + "\n").encode())
        reply = json.loads(self.lines.readline())
        if "error" in reply:
            raise RuntimeError(reply["error"])
        return reply

    def tap(self, button):
        self.request(press=button)
        time.sleep(TAP_S)
        self.request(release=button)

    def operate(self):
        """Watches only the lamps: presses Reset, then Start until the job has started, and each time the flip lamp
        lights turns the object over and presses Start. Ends with the rig."""
        eyes = ControlClient(self.control)
        homed = started = flip_before = False
        try:
            while True:
                lamps = eyes.request(get="outputs")
                if lamps["flip_request"] and not flip_before:
                    eyes.request(turn_over=True)
                    eyes.tap("start")
                elif lamps["start_lamp"] and not lamps["flip_request"] and not started:
                    eyes.tap("start")
                elif lamps["lamp_amber"] and not lamps["busy"] and not lamps["start_lamp"] and not homed:
                    homed = True
                    eyes.tap("reset")
                started = started or lamps["flip_request"] or (lamps["start_lamp"] and eyes.soon_busy())
                flip_before = lamps["flip_request"]
                time.sleep(GLANCE_S)
        except (OSError, ValueError):
            return

    def soon_busy(self):
        end = time.monotonic() + 1
        while time.monotonic() < end:
            if self.request(get="outputs")["busy"]:
                return True
            time.sleep(GLANCE_S)
        return False
