"""One QEMU machine: software emulation, Debian's kernel, systemd, and a way to run commands in it."""
import json
import os
import pathlib
import socket
import subprocess
import time

BOOT_S = 90
KEEP_S = 60
COMMAND_S = 60
UNPLUG_S = 10


class Gone(RuntimeError):
    """The machine does not respond any more."""


class Wire:
    """Lines over a Unix socket that QEMU connects to."""

    def __init__(self, path):
        path.unlink(missing_ok=True)
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(path))
        self.listener.listen(1)
        self.peer = None
        self.pending = b""

    def accept(self, timeout):
        self.listener.settimeout(timeout)
        self.peer, _ = self.listener.accept()

    def send(self, line):
        try:
            self.peer.sendall(line.encode() + b"\n")
        except OSError as problem:
            raise Gone(f"the machine hung up: {problem}") from problem

    def receive(self, timeout):
        """The next line."""
        self.fill(lambda: b"\n" in self.pending, timeout)
        line, self.pending = self.pending.split(b"\n", 1)
        return line.decode()

    def receive_bytes(self, count, timeout):
        self.fill(lambda: len(self.pending) >= count, timeout)
        received, self.pending = self.pending[:count], self.pending[count:]
        return received

    def fill(self, enough, timeout):
        end = time.monotonic() + timeout
        while not enough():
            self.peer.settimeout(max(0.01, end - time.monotonic()))
            try:
                part = self.peer.recv(65536)
            except TimeoutError:
                raise Gone(f"no answer in {timeout} s") from None
            except OSError as problem:
                raise Gone(f"the machine hung up: {problem}") from problem
            if not part:
                raise Gone("the machine hung up")
            self.pending += part

    def close(self):
        for end in (self.peer, self.listener):
            if end:
                end.close()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Machine:
    """`folder` keeps its disk, its sockets and its console output. `system`: system.sqfs, and in the folder above
    linux, initrd, base.sqfs. `kept`: output of keep(), to start from; None to boot. `turntable_port`: serial port
    of the host, for a USB serial adapter; None: no adapter can be plugged in."""

    def __init__(self, folder, system, app, turntable_port, kept=None, cores=2):
        self.folder = pathlib.Path(folder)
        self.console = self.folder / "console.log"
        self.agent = Wire(self.folder / "agent.sock")
        self.eyes = Wire(self.folder / "eyes.sock")
        self.monitor = Wire(self.folder / "qmp.sock")
        self.http_port = free_port()
        self.kept = kept
        cached = system.parent

        def drive(file, options=""):
            return ["-drive", f"file={file},format=raw,if=virtio,{options}"]

        # Nehalem: features of newer processors are little used here, and leaving them out makes emulation quicker.
        command = [
            "qemu-system-x86_64", "-accel", "tcg,thread=multi", "-machine", "q35", "-cpu", "Nehalem", "-smp", cores,
            "-m", 2048, "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot",
            "-kernel", cached / "linux", "-initrd", cached / "initrd",
            "-append", "console=ttyS0 quiet panic=-1 net.ifnames=0 mitigations=off "
            "systemd.show_status=0 systemd.log_target=journal "
            "systemd.unit=hil.target systemd.mask=e2scrub_reap.service systemd.mask=getty.target",
            *drive(cached / "base.sqfs", "readonly=on"), *drive(system / "system.sqfs", "readonly=on"),
            # The host's page cache survives the machine: only data that the guest never wrote out are lost.
            *drive(self.folder / "disk.ext4", "cache=writeback"), *drive(app, "readonly=on"),
            "-chardev", f"file,id=console,path={self.console},append=on", "-serial", "chardev:console",
            "-chardev", "null,id=uart", "-serial", "chardev:uart",
            "-chardev", f"socket,id=qmp,path={self.folder / 'qmp.sock'}", "-mon", "chardev=qmp,mode=control",
            "-device", "virtio-serial-pci",
            "-chardev", f"socket,id=agent,path={self.folder / 'agent.sock'}",
            "-device", "virtserialport,chardev=agent,name=agent",
            "-chardev", f"socket,id=eyes,path={self.folder / 'eyes.sock'}",
            "-device", "virtserialport,chardev=eyes,name=eyes",
            "-device", "qemu-xhci,id=usb",
            *(["-chardev", f"serial,id=turntable,path={turntable_port}"] if turntable_port else []),
            "-netdev", f"user,id=net,restrict=on,hostfwd=tcp:127.0.0.1:{self.http_port}-:80",
            "-device", "virtio-net-pci,netdev=net", *(["-incoming", f"exec:cat {kept}"] if kept else [])]
        self.process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL,
                                        stderr=open(self.folder / "qemu.log", "a"))
        try:
            for wire in (self.monitor, self.agent, self.eyes):
                wire.accept(10)
            self.monitor.receive(10)
            self.qmp("qmp_capabilities")
        except (OSError, Gone) as problem:
            self.kill()
            log = (self.folder / "qemu.log").read_text()[-800:]
            raise RuntimeError(f"qemu did not start ({problem}): {log}") from problem

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()

    def kill(self):
        """Cuts the machine's power, like a pulled mains plug."""
        self.process.kill()
        self.process.wait()
        for wire in (self.agent, self.eyes, self.monitor):
            wire.close()

    def qmp(self, command, **arguments):
        self.monitor.send(json.dumps({"execute": command, "arguments": arguments}))
        while True:
            answer = json.loads(self.monitor.receive(20))
            if "error" in answer:
                raise RuntimeError(f"{command}: {answer['error']['desc']}")
            if "return" in answer:
                return answer["return"]

    def unplug_chardev(self, name):
        """Waits until the device that used it has released it."""
        end = time.monotonic() + UNPLUG_S
        while True:
            try:
                return self.qmp("chardev-remove", id=name)
            except RuntimeError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)

    def keep(self, file):
        """Writes the machine's state to `file`, for another machine to start from, and continues."""
        part = file.with_suffix(".part")
        self.qmp("stop")
        self.qmp("migrate-set-parameters", **{"max-bandwidth": 1 << 40})
        self.qmp("migrate", uri=f"exec:cat >{part}")
        self.wait_for("query-migrate", "completed", KEEP_S)
        part.rename(file)
        self.qmp("cont")

    def wait_for(self, query, status, limit_s):
        end = time.monotonic() + limit_s
        while (answer := self.qmp(query)).get("status") != status:
            if answer.get("status") == "failed" or time.monotonic() > end:
                raise RuntimeError(f"{query}: not {status} within {limit_s} s: {answer}")
            time.sleep(0.05)

    def wait_for_boot(self):
        """Waits until its agent reports that it runs."""
        if self.kept:
            self.wait_for("query-status", "paused", KEEP_S)  # in the state in which it was kept
            self.qmp("cont")
            return
        try:
            self.agent.receive(BOOT_S)
        except Gone as problem:
            tail = self.console.read_text(errors="replace")[-1500:]
            raise RuntimeError(f"the machine did not come up ({problem}); its console said:\n{tail}") from problem

    def call(self, command, timeout=COMMAND_S):
        """Exit code and output of a shell command in the machine."""
        self.agent.send(command.replace("\\", "\\\\").replace("\n", "\\n"))
        code, size = self.agent.receive(timeout).split()
        return int(code), self.agent.receive_bytes(int(size), timeout).decode(errors="replace")

    def do(self, command, timeout=COMMAND_S):
        code, output = self.call(command, timeout)
        if code != 0:
            raise RuntimeError(f"in the machine, {command}: exit code {code}: {output.strip()[-800:]}")
        return output.strip()


def make_disk(file, mebibytes=32 << 10):
    """An empty ext4 disk, sparse, that outlives the machine; larger than what the shipped example keeps free."""
    file.unlink(missing_ok=True)
    with file.open("wb") as disk:
        os.truncate(disk.fileno(), mebibytes << 20)
    subprocess.run(["mke2fs", "-q", "-t", "ext4", "-T", "largefile", "-J", "size=64", "-L", "scans", str(file)],
                   check=True)
