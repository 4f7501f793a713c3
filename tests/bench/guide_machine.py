"""A bare Debian that stays: commands one after the other, a /dev and a network of its own, units that are played."""
import os
import pathlib
import shutil
import subprocess
import time

import bare_machine

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PATHS = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
COMMAND_S = 300
# What every Debian of a PC has and a bare one lacks. The kernel's part of /dev, without devices of this machine.
DEBIAN = ["systemd", "iproute2", "iputils-ping"]
OWN_DEV = """mkdir -p /run/dev && mount -t tmpfs dev /run/dev && mkdir /run/dev/pts /run/dev/shm &&
mount -t devpts -o newinstance,ptmxmode=0666 pts /run/dev/pts && ln -s pts/ptmx /run/dev/ptmx &&
for d in null:1:3 zero:1:5 full:1:7 random:1:8 urandom:1:9 tty:5:0; do
  mknod -m 666 /run/dev/${d%%:*} c $(echo ${d#*:} | tr : ' ') || exit 1; done &&
ln -s /proc/self/fd /run/dev/fd && chmod 1777 /run/dev/shm && mount --rbind /run/dev /dev && exec sleep infinity"""


def only_child(pid):
    """The last of a chain of processes that have one child each."""
    while children := pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        pid = int(children[0])
    return pid


class Machine:
    """Runs from entering until leaving it. All of its processes end then."""

    def __init__(self, root):
        self.root = root
        self.network = None
        self.processes = []

    def __enter__(self):
        shutil.copy(ROOT / "tests" / "package" / "play_units.sh", self.root / "usr/local/bin/systemctl")
        os.chmod(self.root / "usr/local/bin/systemctl", 0o755)
        holder = subprocess.Popen(bare_machine.entrance(self.root, OWN_DEV))
        self.processes.append(holder)
        self.wait_for(lambda: self.comm(only_child(holder.pid)) == "sleep" or holder.poll() is not None, 60)
        self.init = only_child(holder.pid)
        return self

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.kill()
            process.wait()

    @staticmethod
    def comm(pid):
        return pathlib.Path(f"/proc/{pid}/comm").read_text().strip()

    @staticmethod
    def wait_for(condition, limit_s, every_s=0.2):
        end = time.monotonic() + limit_s
        while not (held := condition()) and time.monotonic() < end:
            time.sleep(every_s)
        return held

    def own_network(self):
        """From here on commands run in a network that has 127.0.0.1 and 127.0.0.2 and nothing else."""
        holder = self.start("exec scanrig-sim own-network -- sleep infinity")
        if not self.wait_for(lambda: self.comm(only_child(holder.pid)) == "sleep", 30):
            raise RuntimeError("no network of its own")
        self.network = f"/proc/{only_child(holder.pid)}/ns/net"

    def inside(self, line, **environment):
        """Command line for a shell line of root inside."""
        net = [f"--net={self.network}"] if self.network else []
        values = {"PATH": PATHS, "HOME": "/root", "LANG": "C.UTF-8", **environment}
        enter = ["nsenter", f"--target={self.init}", "--mount", "--pid", *net, "--root", "--wd"]
        clean = ["/usr/bin/env", "-i", *(f"{name}={value}" for name, value in values.items())]
        return ["taskset", "-c", bare_machine.CORES, *enter, *clean, "sh", "-c", f"cd && {line}"]

    def start(self, line, **options):
        """A process that ends with the machine."""
        environment = options.pop("environment", {})
        self.processes.append(subprocess.Popen(self.inside(line, **environment), **options))
        return self.processes[-1]

    def run(self, line, timeout_s=COMMAND_S, **environment):
        """Exit code and everything printed."""
        try:
            done = subprocess.run(self.inside(line, **environment), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True, timeout=timeout_s)
        except subprocess.TimeoutExpired as late:
            return 124, f"{late.stdout or ''}\nstill running after {timeout_s} s"
        return done.returncode, done.stdout
