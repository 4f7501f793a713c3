"""The API's access rules, by its document: roles, tokens, traversal, bodies; no secret in logs; the unit's exposure."""
import re
import socket
import time

import motion_rig
import station_load
import virtual_machine

ROLES = ("viewer", "operator", "engineer")
GOOD = {"id": "no-such-job", "file": "scan.json", "side": "left"}
TRAVERSALS = ("..", "%2e%2e", "..%2f..%2fetc%2fpasswd", "%2fetc%2fpasswd", "..%5c..", "a%00b", "%252e%252e", "%c0%ae%c0%ae")
BAD_BODIES = ("{", "[]", "null", '{"no_such_key": 1}', '{"a":1,"a":2}', "\xff", "[" * 5000, '{"a":' * 5000)
OVERSIZED = " " * 100_000
PATIENCE_S = 10
TOO_MANY, PAUSE_S = 429, 0.2


class Door:
    def __init__(self, port):
        self.port = port

    def ask(self, method, target, token="", body="", more=""):
        """Status of one request, repeated while it is rate-limited; 0 without a reply."""
        status = self.once(method, target, token, body, more)
        while status == TOO_MANY:
            time.sleep(PAUSE_S)
            status = self.once(method, target, token, body, more)
        return status

    def connect(self):
        """A daemon that reloads its configuration closes its socket for a moment."""
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                return socket.create_connection(("127.0.0.1", self.port), PATIENCE_S)
            except ConnectionRefusedError:
                if time.monotonic() > end:
                    raise
                time.sleep(PAUSE_S)

    def once(self, method, target, token, body, more):
        text = f"{method} {target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{more}"
        if token:
            text += f"Authorization: Bearer {token}\r\n"
        if body:
            text += f"Content-Length: {len(body.encode('latin-1'))}\r\n"
        with self.connect() as peer:
            peer.settimeout(PATIENCE_S)
            try:
                peer.sendall((text + "\r\n" + body).encode("latin-1"))
                while (head := peer.recv(1 << 16)) and len(head) < 12:
                    pass
            except OSError:
                return 0
        return int(head[9:12]) if len(head) >= 12 else 0


def operations(document):
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield method.upper(), path, operation


def filled(path, which="", value=""):
    for name, good in GOOD.items():
        path = path.replace("{" + name + "}", value if name == which else good)
    return path


def roles(door, document, tokens):
    """Every route, every role, no token, a bad token; (tried, wrong)."""
    tried, wrong = 0, []
    for method, path, operation in operations(document):
        target, needed = filled(path), ROLES.index(operation["x-role"])
        documented = {int(code) for code in operation["responses"]} - {403}
        # The page's own files and its login are open to everybody.
        stranger = documented if operation.get("security") == [] else {401}
        cases = [("no token", "", stranger), ("a bad token", "scanrig_" + "0" * 64, stranger)]
        for index, role in enumerate(ROLES):
            allowed = documented - {401} if index >= needed else {403}
            cases.append((role, tokens[role], allowed))
        for name, token, wanted in cases:
            status = door.ask(method, target, token)
            tried += 1
            if status not in wanted:
                wrong.append(f"{method} {path} as {name}: {status}")
    return tried, wrong


def hostile(door, document, token):
    """Traversal in every path parameter, bodies that do not fit, headers and bodies too large; (tried, wrong)."""
    tried, wrong = 0, []

    def expect(wanted, name, *request, **options):
        nonlocal tried
        tried += 1
        status = door.ask(*request, **options)
        if status not in wanted:
            wrong.append(f"{request[0]} {request[1][:80]}, {name}: {status}")

    for method, path, _ in operations(document):
        for name in re.findall(r"\{(\w+)\}", path):
            for value in TRAVERSALS:
                expect({400, 404}, "traversal", method, filled(path, name, value), token)
        if method == "POST":
            for body in BAD_BODIES:
                expect({400}, f"body {body[:20]!r}", method, filled(path), token, body)
        expect({413}, "a large body", method, filled(path), token, OVERSIZED)
        expect({431}, "a large header", method, filled(path), token, "", "X-More: " + "x" * 9000 + "\r\n")
        expect({400, 404}, "a long target", method, filled(path) + "?" + "a=1&" * 600, token)
    return tried, wrong


def report(bench, what, tried, wrong):
    bench.line(what, "as documented", f"{tried} requests, " + ("; ".join(wrong[:5]) or "all as documented"), not wrong)


def measure(bench, scratch):
    with motion_rig.Rig(bench.bin, scratch / "security", "--poses", "1") as rig:
        port, viewer = station_load.open_api(rig)
        tokens = {"viewer": viewer}
        for role in ROLES[1:]:
            made = bench.run([bench.bin / "scanrig", "token", "add", role, "--role", role, "--config", rig.config], 10)
            tokens[role] = made.stdout.strip()
        rig.start_daemon()
        door = Door(port)
        document = rig.ask("openapi.json")
        report(bench, "security: every route, every role, no token, a bad token", *roles(door, document, tokens))
        report(bench, "security: traversal, malformed and oversized requests", *hostile(door, document, tokens["engineer"]))
        alive = rig.status() is not None
        bench.line("security: the daemon after all that", "answers", "answers" if alive else "gone", alive)
        rig.kill_daemon(15)
        written = b"".join(path.read_bytes() for path in rig.folder.rglob("*") if path.is_file())
    leaks = [role for role, token in tokens.items() if token.encode() in written]
    bench.line("security: tokens in logs or files", "none", ", ".join(leaks) or "none", not leaks)
    if not bench.quick:
        virtual_machine.rows(bench, "security of the unit while the wired rig works", "--only", "unit", "pose")
