"""A Slurm cluster of two nodes on the loopback, of Debian's packages: munged, slurmctld and two slurmd, in one folder.

Nothing of the machine's own configuration is used or changed, and only processes that were started here are ended.
"""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

PACKAGES = ("slurmctld", "slurmd", "slurm-client", "munge")
PROGRAMS = ("sbatch", "squeue", "scontrol", "scancel", "slurmctld", "slurmd", "munged")
NODES = ("n1", "n2")
CONTROLLER_PORT = 17817
NODE_LOST_S = 15  # of a slurmd that does not respond, until its node is down

CONFIG = """ClusterName=bench
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,batch_sched_delay=0,defer_batch
ReturnToService=2
SlurmdTimeout={lost}
KillWait=2
{nodes}
PartitionName=main Nodes=n1,n2 Default=YES State=UP
"""


def missing_programs():
    path = os.environ["PATH"] + ":/usr/sbin"
    return [program for program in PROGRAMS if shutil.which(program, path=path) is None]


def install():
    """Names of programs that are missing still."""
    if missing_programs() and os.geteuid() == 0:
        # The packages' own services are not started: this cluster is beside them.
        policy = pathlib.Path("/usr/sbin/policy-rc.d")
        is_ours = not policy.exists()
        if is_ours:
            policy.write_text("#!/bin/sh\nexit 101\n")
            policy.chmod(0o755)
        try:
            for words in (["update", "-qq"], ["install", "-y", "-qq", "--no-install-recommends", *PACKAGES]):
                subprocess.run(["apt-get", *words], env=dict(os.environ, DEBIAN_FRONTEND="noninteractive"),
                               capture_output=True, timeout=600, check=False)
        finally:
            if is_ours:
                policy.unlink()
    return missing_programs()


def wait_for(what, timeout_s, ready):
    end = time.monotonic() + timeout_s
    while not ready():
        if time.monotonic() > end:
            raise RuntimeError(f"{what}: not within {timeout_s} s")
        time.sleep(0.2)


class Cluster:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True)
        (self.folder / "state").mkdir()
        self.config = self.folder / "slurm.conf"
        host = socket.gethostname().split(".")[0]
        nodes = []
        for number, node in enumerate(NODES, 1):
            (self.folder / f"spool-{node}").mkdir()
            nodes.append(f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={CONTROLLER_PORT + number} CPUs=1 "
                         f"RealMemory=2000 State=UNKNOWN")
        self.config.write_text(CONFIG.format(host=host, port=CONTROLLER_PORT, folder=self.folder, lost=NODE_LOST_S,
                                             nodes="\n".join(nodes)))
        self.env = dict(os.environ, SLURM_CONF=str(self.config), PATH=os.environ["PATH"] + ":/usr/sbin")
        self.running = {}

    def __enter__(self):
        try:
            key = self.folder / "munge.key"
            key.write_bytes(os.urandom(1024))
            key.chmod(0o400)
            sock = self.folder / "munge.sock"
            self.start("munged", "-F", "--force", "--socket", sock, "--key-file", key, "--pid-file",
                       self.folder / "munged.pid", "--log-file", self.folder / "munged.log", "--seed-file",
                       self.folder / "munged.seed")
            wait_for("munged", 20, sock.exists)
            self.start_controller()
            for node in NODES:
                self.start_node(node)
            wait_for("two idle nodes", 60, lambda: self.run("sinfo", "-h", "-N", "-o", "%T").split() == ["idle", "idle"])
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for node in NODES:
            for pid in self.steps(node):
                self.end(pid)
        for process in self.running.values():
            process.terminate()
        for process in self.running.values():
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, name, *words, key=None):
        program = shutil.which(name, path=self.env["PATH"])
        with open(self.folder / f"{key or name}.out", "a") as out:
            self.running[key or name] = subprocess.Popen([program, *map(str, words)], env=self.env, stdout=out, stderr=out)

    def start_controller(self):
        self.start("slurmctld", "-D", "-f", self.config)
        wait_for("slurmctld", 60, lambda: "UP" in self.run("scontrol", "ping"))

    def stop_controller(self):
        self.running["slurmctld"].terminate()
        self.running["slurmctld"].wait(30)

    def start_node(self, node):
        self.start("slurmd", "-D", "-N", node, "-f", self.config, key=f"slurmd-{node}")

    def steps(self, node):
        """Processes of this cluster's jobs on the node: they have its name and configuration in their environment."""
        marks = {f"SLURMD_NODENAME={node}".encode(), f"SLURM_CONF={self.config}".encode()}
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    if marks <= set((entry / "environ").read_bytes().split(b"\0")):
                        found.append(int(entry.name))
                except OSError:
                    pass  # it has ended
        return found

    @staticmethod
    def end(pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass

    def kill_node(self, node):
        """slurmd and all it started, at once."""
        self.running[f"slurmd-{node}"].kill()
        self.running[f"slurmd-{node}"].wait()
        for pid in self.steps(node):
            self.end(pid)

    def repair(self):
        """Whatever was ended runs again."""
        if self.running["slurmctld"].poll() is not None:
            self.start_controller()
        for node in NODES:
            if self.running[f"slurmd-{node}"].poll() is not None:
                self.start_node(node)

    def run(self, *words):
        return subprocess.run([str(word) for word in words], env=self.env, capture_output=True, text=True, timeout=120,
                              check=False).stdout
