"""What the packages do where systemd runs, from the first installation to the purge; each function is a row."""
import re
import time

from station import Unmet

OLD, NEW = "/run/packages/old", "/run/packages/new"
CONFIG = "/etc/scanrig/rig.toml"
JOBS = "/var/lib/scanrig/jobs"
SIMULATED_JOBS = "/var/lib/scanrig-sim/jobs"
SIMULATED = "--socket /run/scanrig-sim/api.sock"
GROUPS = "dialout gpio plugdev scanrig video"
# A small part, small images and a coarse model: an emulated machine is slow.
SMALL = "--object /run/packages/part.obj --height-mm 50 --scale 0.12 --voxel-mm 5 --operator helper"
SHORT_JOB = "--views 6 --clock virtual"
# Outlasts an upgrade however slow the machine, and leaves it the processor: a real rig's cameras take none of it.
ENDLESS_JOB = "--views 72 --clock real --background-cameras"
LOW_PRIORITY = "CPUWeight=idle"  # Nice= does not count between this unit and others: the unit has a weight
JOB_S, RECOVERY_S, INSTALL_S = 300, 180, 300


def expect(true, what):
    if not true:
        raise Unmet(what)


def wait(what, ready, limit_s, pause_s=0.3):
    """Result of `ready`, once it is true."""
    end = time.monotonic() + limit_s
    while not (found := ready()):
        if time.monotonic() > end:
            raise Unmet(f"not {what} within {limit_s} s")
        time.sleep(pause_s)
    return found


def said(text):
    """Lines that the packages' own scripts printed."""
    return " ".join(line for line in text.splitlines() if line.startswith("scanrig") or "rig.toml" in line)


def install(machine, packages):
    """Output of an installation with apt, without a network."""
    return machine.do(f"DEBIAN_FRONTEND=noninteractive apt-get install -y -q {packages} 2>&1", INSTALL_S)


def install_again(machine, packages):
    """Output of an installation with dpkg, where apt would find nothing to add."""
    return machine.do(f"dpkg -i {packages} 2>&1", INSTALL_S)


def active(machine, unit):
    return machine.call(f"systemctl is-active {unit}")[1].strip()


def version(machine):
    return machine.do("dpkg-query -W -f '${Version}' scanrig")


def installed(machine):
    """The first installation: enabled, not started, because there is no rig.toml."""
    words = install(machine, f"{OLD}/*.deb")
    expect(f"there is no {CONFIG}" in words, f"apt said: {words[-300:]}")
    enabled = machine.do("systemctl is-enabled scanrigd.service scanrigd.socket").split()
    expect(enabled == ["enabled", "enabled"], f"enabled: {enabled}")
    states = [active(machine, unit) for unit in ("scanrigd.service", "scanrigd.socket", "scanrigd-sim.service")]
    expect(states == ["inactive"] * 3, f"the units are {states}")
    return f"{version(machine)}; enabled; {said(words)}"


def in_place(machine):
    """User, groups, folders, kernel settings, units and files as packed."""
    verified = machine.call("systemd-analyze verify scanrigd.service scanrigd.socket scanrigd-sim.service 2>&1")[1]
    problems = [line for line in verified.splitlines() if "scanrig" in line]
    expect(not problems, f"systemd-analyze verify: {problems}")
    groups = " ".join(sorted(machine.do("id -nG scanrig").split()))
    expect(groups == GROUPS, f"groups: {groups}")
    folders = machine.do("stat -c '%n %U %a' /etc/scanrig /var/lib/scanrig").splitlines()
    expect(folders == ["/etc/scanrig root 775", "/var/lib/scanrig scanrig 755"], f"folders: {folders}")
    set_values = machine.do("sysctl -e -p /usr/lib/sysctl.d/50-scanrig.conf")
    now = machine.do("grep -v '^#' /usr/lib/sysctl.d/50-scanrig.conf | cut -d= -f1 | xargs sysctl")
    expect(now == set_values and now, f"kernel settings: {now}, asked: {set_values}")
    group = machine.do("stat -c '%G' /dev/gpiochip0")
    expect(group == "gpio", f"the GPIO chip is of group {group}")
    wrong = machine.call("dpkg -V scanrig scanrig-sim")[1].strip()
    expect(not wrong, f"files not as packed: {wrong}")
    failed = machine.do("systemctl --failed --plain --no-legend")
    expect(not failed, f"failed units: {failed}")
    return f"user, {len(groups.split())} groups, {len(now.splitlines())} kernel settings, GPIO rule, units, files"


def simulate(machine, unit, socket, jobs, options, *settings):
    """The unit's command becomes a quick simulated rig, as with systemctl edit. It does not notify systemd."""
    lines = ["[Service]", "Type=exec", "WatchdogSec=0", *settings, "ExecStopPost=", "ExecStart=",
             f"ExecStart=/usr/bin/scanrigd-sim --socket {socket} --jobs {jobs} {SMALL} {options}"]
    folder = f"/etc/systemd/system/{unit}.service.d"
    text = "\\n".join(lines)
    machine.do(f"mkdir -p {folder} && printf '{text}\\n' >{folder}/small.conf && systemctl daemon-reload")


def first_page(machine):
    """One command after the installation gives a page with a rig to try."""
    simulate(machine, "scanrigd-sim", "/run/scanrig-sim/api.sock", SIMULATED_JOBS,
             f"{SHORT_JOB} --http-port 8081")
    begun = time.monotonic()
    address = machine.do("scanrig-demo", RECOVERY_S).splitlines()[0]
    found = re.match(r"(http://127\.0\.0\.1:8081/)#code=\S+$", address)
    expect(found, f"scanrig-demo printed {address}")
    fetch = "curl -sf --compressed --max-time 20"
    page = machine.do(f"{fetch} {found[1]}")
    script = re.search(r"/assets/main-[^\"]*\.js", page)
    expect(script, f"the page names no script: {page[:200]}")
    size = machine.do(f"{fetch} http://127.0.0.1:8081{script[0]} | wc -c")
    expect(int(size) > 10000, f"its script has {size} bytes")
    return f"address with a code; page and script ({size} bytes), {time.monotonic() - begun:.1f} s after the command"


def wait_until_ready(machine, socket=""):
    wait("ready", lambda: "Ready" in machine.call(f"scanrig status {socket}")[1], RECOVERY_S)


def whole_job(machine):
    """Scanned, turned over, modelled by the simulated rig's own unit."""
    wait_until_ready(machine, SIMULATED)
    begun = time.monotonic()
    words = machine.do(f"scanrig start --follow {SIMULATED} 2>&1", JOB_S)
    size = machine.do(f"stat -c %s {SIMULATED_JOBS}/*/model/model.glb")
    machine.do("systemctl stop scanrigd-sim.service", RECOVERY_S)
    return f"{words.split()[-1].rsplit('/', 1)[-1]}; model of {size} bytes, {time.monotonic() - begun:.0f} s"


def refused_config(machine):
    machine.do(f"sed 's/^gear_ratio.*/gear_ratio = 0/' /usr/share/scanrig/rigs/example.toml >{CONFIG}")
    words = install_again(machine, f"{OLD}/scanrig_*.deb")
    expect("gear_ratio" in words and "not started with" in words, f"dpkg said: {words[-300:]}")
    expect(active(machine, "scanrigd.service") == "inactive", "the service runs with an invalid rig.toml")
    return said(words)


def started(machine):
    """With a valid rig.toml the package starts the service: the real one, whose devices are missing here."""
    machine.do(f"install -m 0644 /usr/share/scanrig/rigs/example.toml {CONFIG}")
    install_again(machine, f"{OLD}/scanrig_*.deb")
    wait("active", lambda: active(machine, "scanrigd.service") == "active", RECOVERY_S)
    words = wait("answering", lambda: machine.call("scanrig status")[1].strip(), RECOVERY_S)
    return "active; " + " ".join(words.splitlines()[0].split())


def hashes(machine, job):
    return machine.do(f"cd {JOBS}/{job} && find . -type f -exec sha256sum {{}} + | sort")


def upgraded(machine):
    """With a finished job on the disk and another one running, whose stored views stay."""
    machine.do(f"systemctl stop scanrigd.service scanrigd.socket && mkdir -p {JOBS} && cp -r {SIMULATED_JOBS}/* {JOBS} && "
               f"chown -R scanrig: {JOBS}", RECOVERY_S)
    finished = machine.do(f"ls {JOBS} | grep -v '[.]'")
    before = hashes(machine, finished)
    simulate(machine, "scanrigd", "/run/scanrig/api.sock", JOBS, ENDLESS_JOB, LOW_PRIORITY)
    machine.do("systemctl start scanrigd.service", RECOVERY_S)  # without its socket: this program opens one itself
    wait_until_ready(machine)
    machine.do("scanrig start 2>&1")
    job = wait("a job", lambda: re.findall(r"^  job: (\S+)", machine.call("scanrig status")[1], re.M), RECOVERY_S)[0]
    wait("a view stored", lambda: machine.call(f"ls {JOBS}/{job}/pose1/view00/")[0] == 0, JOB_S)
    words = install(machine, f"{NEW}/*.deb")
    expect(f"interrupted job {job}" in words, f"apt said: {words[-400:]}")
    wait_until_ready(machine)
    states = {line.split()[0]: line for line in machine.do("scanrig jobs").splitlines()}
    expect("interrupted" in states.get(job, "") and "done" in states.get(finished, ""), f"jobs: {states}")
    expect(hashes(machine, finished) == before, "files of the finished job have changed")
    views = machine.do(f"ls -d {JOBS}/{job}/pose1/view* | wc -l")
    return f"to {version(machine)}; {said(words)}; {views} of its views kept, the finished job unchanged"


def downgraded(machine):
    before = version(machine)
    code, words = machine.call(f"dpkg -i {OLD}/scanrig_*.deb 2>&1", INSTALL_S)
    expect(code != 0 and f"is older than the installed {before}" in words, f"dpkg said: {words[-300:]}")
    expect(version(machine) == before and active(machine, "scanrigd.service") == "active", "it did not stay as it was")
    return said(words)


def removed(machine):
    jobs = machine.do(f"ls {JOBS} | grep -vc '[.]'")
    machine.do("dpkg -r scanrig-sim scanrig", INSTALL_S)
    gone = machine.call("pgrep -u scanrig")[0] != 0 and machine.call("test -e /usr/bin/scanrigd")[0] != 0
    expect(gone, "the service or its program is still there")
    kept = machine.do(f"ls {CONFIG} && ls {JOBS} | grep -vc '[.]'").split()
    expect(kept == [CONFIG, jobs], f"kept: {kept}")
    return f"the service has stopped; rig.toml and {jobs} jobs kept"


def purged(machine):
    jobs = machine.do(f"ls {JOBS} | grep -vc '[.]'")
    machine.do("rm -r /etc/systemd/system/scanrig*.service.d")  # the test's own
    words = machine.do("dpkg -P scanrig-sim scanrig 2>&1", INSTALL_S)
    expect("are kept in /var/lib/scanrig" in words, f"dpkg said: {words[-300:]}")
    expect(machine.do(f"ls {JOBS} | grep -vc '[.]'") == jobs, "jobs are lost")
    left = machine.do("find /etc /usr /var/lib -name '*scanrig*' -not -path '/var/lib/dpkg/*' -not -path "
                      "'/var/lib/scanrig*' -not -path '/var/lib/apt/*'")
    expect(not left, f"left: {left}")
    return f"{jobs} jobs kept; {said(words)}"


def purged_with_jobs(machine):
    install_again(machine, f"{OLD}/*.deb")
    machine.do("SCANRIG_PURGE_JOBS=yes dpkg -P scanrig-sim scanrig 2>&1", INSTALL_S)
    expect(machine.call("test -e /var/lib/scanrig")[0] != 0, "/var/lib/scanrig is still there")
    return "no /var/lib/scanrig"


ROWS = [("installed with apt", "enabled, not started: no rig.toml", installed),
        ("what it brings", "in place", in_place),
        ("scanrig-demo: the first page", "address, page, script", first_page),
        ("a whole simulated job", "a model", whole_job),
        ("installed again with an invalid rig.toml", "not started; the problem named", refused_config),
        ("installed again with a valid rig.toml", "started", started),
        ("upgraded with a job running and one on disk", "one interrupted by name, one unchanged", upgraded),
        ("downgraded", "refused", downgraded),
        ("removed", "stopped; rig.toml and jobs kept", removed),
        ("purged", "jobs kept, nothing else", purged),
        ("purged with SCANRIG_PURGE_JOBS=yes", "jobs gone", purged_with_jobs)]
