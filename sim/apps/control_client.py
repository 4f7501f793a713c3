"""The hand at the simulated rig on the wire: what tests and people do through its control socket."""
import json
import socket
import time

GLANCE_S = 0.1
TAP_S = 0.2  # as a hand does; the panel debounces for 50 ms


class ControlClient:
    """Threads: one at a time, apart from operate(), which has a connection of its own."""

    def __init__(self, control):
        self.control = control
        self.connect()

    def connect(self):
        self.peer = socket.socket(socket.AF_UNIX)
        self.peer.connect(str(self.control))
        self.lines = self.peer.makefile("r")

    def say(self, **request):
        """Asks the rig; raises RuntimeError with its sentence when it did not understand."""
        self.peer.sendall((json.dumps(request) + "\n").encode())
        answer = json.loads(self.lines.readline())
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer

    def tap(self, button):
        self.say(press=button)
        time.sleep(TAP_S)
        self.say(release=button)

    def operate(self):
        """Looks at nothing but the lamps: presses Reset, then Start until the job has begun, and each time the flip
        lamp comes on turns the object over and presses Start. Ends with the rig."""
        eyes = ControlClient(self.control)
        homed = begun = flip_before = False
        try:
            while True:
                lamps = eyes.say(get="outputs")
                if lamps["flip_request"] and not flip_before:
                    eyes.say(turn_over=True)
                    eyes.tap("start")
                elif lamps["start_lamp"] and not lamps["flip_request"] and not begun:
                    eyes.tap("start")
                elif lamps["lamp_amber"] and not lamps["busy"] and not lamps["start_lamp"] and not homed:
                    homed = True
                    eyes.tap("reset")
                begun = begun or lamps["flip_request"] or (lamps["start_lamp"] and eyes.soon_busy())
                flip_before = lamps["flip_request"]
                time.sleep(GLANCE_S)
        except (OSError, ValueError):
            return

    def soon_busy(self):
        end = time.monotonic() + 1
        while time.monotonic() < end:
            if self.say(get="outputs")["busy"]:
                return True
            time.sleep(GLANCE_S)
        return False
