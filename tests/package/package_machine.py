"""A bare Debian with nothing but the packages' dependencies, started in the virtual machine of tests/hil.

The bare Debian is kept under build/bare. In a copy apt installs the packages with all that they depend on; then they
are purged, and what remains is the machine's first disk. The packages themselves are on its last disk, mounted at
/run/packages.
"""
import contextlib
import pathlib
import shutil
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
for folder in ("hil", "bench"):
    sys.path.append(str(HERE.parent / folder))
import bare_machine  # noqa: E402
import image  # noqa: E402
import machine  # noqa: E402

SUPPORT = ["systemd-sysv", "udev", "kmod", "dbus", "iproute2", "curl"]
INSTALL_S, SQUASH_S = 600, 300
BARE = HERE.parent.parent / "build" / "bare"
APT = "apt-get install -y -qq --no-install-recommends"
# This machine does not outlive the test. Its disk is a squashfs, under a file system in memory.
UNSAFE_IO = "echo force-unsafe-io >/etc/dpkg/dpkg.cfg.d/test"
FORGET = "apt-get clean && rm -rf /var/lib/apt/lists/* /packages"
# The jobs' folder is on the disk, and dpkg's database with it: the file system in memory is small.
# tests/hil has units of its own for the service that it installs.
MOUNT = ("cd /usr/lib/systemd/system && rm var-lib-scanrig.mount multi-user.target.wants/scanrigd.service && "
         "systemctl daemon-reload && mkdir -p /run/disk /run/packages && "
         "mount -t ext4 /dev/vdc /run/disk && cp -a /var/lib/. /run/disk && umount /run/disk && "
         "mount -t ext4 /dev/vdc /var/lib && mount -t squashfs -o ro /dev/vdd /run/packages")


class Installed:
    """What apt reported on the bare machine."""

    def __init__(self, code, output, seconds, left):
        self.ok = code == 0
        self.output = output
        self.seconds = seconds
        self.left = left  # files with the project's name after the purge


def bare_debian(suite):
    """A tar of Debian's smallest set of packages and systemd, made if there is none."""
    tar = BARE / f"{suite}.tar"
    if not tar.is_file():
        BARE.mkdir(parents=True, exist_ok=True)
        making = BARE / f"{suite}.part.tar"
        image.run("mmdebstrap", "--quiet", "--variant=minbase", f"--include={','.join(SUPPORT)}", suite, making,
                  bare_machine.archive())
        making.rename(tar)
    return tar


@contextlib.contextmanager
def unpacked(tar):
    with tempfile.TemporaryDirectory(prefix="scanrig-bare-") as folder:
        root = pathlib.Path(folder)
        image.run("tar", "-xpf", tar, "-C", root)
        shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")
        yield root


def make_disk(suite, packages, target):
    """Writes the disk `target` of a Debian `suite` on which `packages` can be installed without a network."""
    with unpacked(bare_debian(suite)) as root:
        (root / "packages").mkdir()
        (root / "packages").chmod(0o755)
        for package in packages:
            shutil.copy(package, root / "packages")
        done, seconds = bare_machine.run_inside(
            root, f"{UNSAFE_IO} && apt-get update -qq && "
            f"DEBIAN_FRONTEND=noninteractive {APT} /packages/*.deb >/tmp/log 2>&1 || {{ tail -5 /tmp/log; exit 1; }}; "
            "dpkg-query -W -f '${Package} ${Version} ${db:Status-Status} ' 'scanrig*'", INSTALL_S)
        purged, _ = bare_machine.run_inside(
            root, f"dpkg -P scanrig-sim scanrig >/dev/null && {FORGET} && "
            "find /etc /usr /var/lib -name '*scanrig*' -not -path '/var/lib/dpkg/*'", INSTALL_S)
        image.run("mksquashfs", root, target, *image.SQUASH, timeout=SQUASH_S)
    return Installed(done.returncode, done.stdout.strip(), seconds, purged.stdout.split())


def lay_out(cached, system, disk, folder):
    """Place of the machine's files as machine.Machine expects them; the kernel is that of tests/hil."""
    place = folder / "boot"
    place.mkdir()
    for name in ("linux", "initrd"):
        (place / name).symlink_to(cached / name)
    disk.rename(place / "base.sqfs")
    (place / "system").mkdir()
    (place / "system" / "system.sqfs").symlink_to(system / "system.sqfs")
    return place / "system"


def boot(folder, system, packages):
    """A machine whose systemd runs, with old/ and new/ of the folder `packages` under /run/packages."""
    image.run("mksquashfs", packages, folder / "packages.sqfs", *image.SQUASH)
    machine.make_disk(folder / "disk.ext4")
    started = machine.Machine(folder, system, folder / "packages.sqfs", None, cores=1)
    try:
        started.wait_for_boot()
        started.do(MOUNT, 120)
        started.do("systemctl start --no-block multi-user.target")
    except BaseException:
        started.kill()
        raise
    return started
