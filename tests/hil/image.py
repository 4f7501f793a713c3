"""The virtual machine's disks, made without root mounts and kept under build/hil until their sources change.

base.sqfs   Debian: systemd, udev and the packages that the installed programs' libraries are in
linux       Debian's kernel, uncompressed: the emulated processor would take seconds for that
kernel/     the modules that the scenario needs, gpio-sim built from the same kernel's source
initrd      busybox: mounts system.sqfs over base.sqfs and a tmpfs over both
system-*/   what turns Debian into this machine: system.sqfs of tests/hil/guest and the modules, and the machine booted
app.sqfs    what `cmake --install` installs; made anew every time
"""
import hashlib
import lzma
import os
import pathlib
import platform
import re
import shutil
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SUITE = platform.freedesktop_os_release()["VERSION_CODENAME"]  # the programs were built with its libraries
SYSTEM_PACKAGES = ["systemd-sysv", "udev", "kmod", "dbus", "iproute2", "procps", "usbip"]
INITRD_MODULES = ["virtio_pci", "virtio_blk", "squashfs", "overlay", "ext4", "virtio_console"]
MODULES = INITRD_MODULES + ["vivid", "vhci_hcd", "usbhid", "ftdi_sio", "xhci_pci", "virtio_net", "veth", "configfs",
                            "gpio_sim", "v4l2loopback"]
APP_SIZE = 64 << 20
# They look for what this machine does not have, at every reload of systemd: a quarter of a second each.
NO_GENERATORS = ["cryptsetup", "getty", "gpt-auto", "hibernate-resume", "integritysetup", "rc-local", "run", "ssh",
                 "system-update", "sysv", "tpm2", "veritysetup"]
SQUASH = ["-comp", "lz4", "-noappend", "-no-progress", "-quiet", "-all-root"]


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]}: {(done.stderr or done.stdout).strip()[-800:]}")
    return done.stdout


def kernel_version():
    """Version of the installed headers: kernel, modules and gpio-sim must be of one version."""
    wanted = run("dpkg-query", "-W", "-f", "${Depends}", "linux-headers-amd64")
    return re.search(r"linux-headers-(\S+)", wanted)[1]


def library_packages(programs):
    """Debian packages with the shared libraries of these programs."""
    files = set()
    for program in programs:
        files |= {str(pathlib.Path(file).resolve()) for file in re.findall(r"(/\S+)", run("ldd", program))}
    # dpkg lists files by their place before /lib became /usr/lib, or after.
    names = [name for file in files for name in (file, file.removeprefix("/usr"))]
    found = subprocess.run(["dpkg", "-S", *names], capture_output=True, text=True).stdout
    return sorted({line.split(":")[0] for line in found.splitlines() if ": " in line})


def make_base(folder, packages):
    """The wires of the scenario are in the kernel, so documentation, manuals and translations stay out."""
    leave_out = [f"--dpkgopt=path-exclude=/usr/share/{part}/*" for part in ("doc", "man", "locale", "info")]
    root = folder / "base.tar"
    run("mmdebstrap", "--quiet", "--variant=minbase", *leave_out, f"--include={','.join(packages)}", SUITE, root)
    with root.open() as tar:
        run("mksquashfs", "-", folder / "base.sqfs", "-tar", *SQUASH, stdin=tar)
    root.unlink()


def build_module(build, version, name, sources):
    objects = " ".join(f"{pathlib.Path(source).stem}.o" for source in sources)
    (build / "Kbuild").write_text(f"obj-m := {name}.o\n" + (f"{name}-y := {objects}\n" if len(sources) > 1 else ""))
    run("make", "-s", "-C", f"/usr/src/linux-headers-{version}", f"M={build}", "modules")
    return build / f"{name}.ko"


def build_v4l2loopback(folder, version):
    """A video device whose frames a program writes. Its stamps are the monotonic clock's, but it does not report so."""
    run("apt-get", "download", "-qq", "v4l2loopback-dkms", cwd=folder)
    package = next(folder.glob("v4l2loopback-dkms_*.deb"))
    run("dpkg-deb", "-x", package, folder / "v4l2loopback")
    source = next((folder / "v4l2loopback").rglob("v4l2loopback.c"))
    text = source.read_text().replace("b->flags = 0;", "b->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;")
    source.write_text(text)
    return build_module(source.parent, version, "v4l2loopback", [source.name])


def build_gpio_sim(folder, version):
    """Debian's kernel comes without gpio-sim. Its source and that of the simulated interrupts become one module."""
    build = folder / "gpio-sim"
    build.mkdir()
    wanted = ["drivers/gpio/gpio-sim.c", "drivers/gpio/gpiolib.h", "kernel/irq/irq_sim.c"]
    source = next(pathlib.Path("/usr/src").glob("linux-source-*.tar.xz"))
    stem = source.name.removesuffix(".tar.xz")
    run("tar", "xf", source, "-C", build, "--strip-components=1", *(f"{stem}/{file}" for file in wanted))
    for file in wanted:
        (build / file).rename(build / pathlib.Path(file).name)
    irq = build / "irq_sim.c"
    text = re.sub(r"^EXPORT_SYMBOL\S*;\n", "", irq.read_text(), flags=re.M)
    irq.write_text(text.replace("handle_simple_irq(irq_to_desc(irqnum))", "generic_handle_irq(irqnum)"))
    gpio = build / "gpio-sim.c"
    gpio.rename(build / "gpio-sim-main.c")
    return build_module(build, version, "gpio-sim", ["gpio-sim-main.c", "irq_sim.c"])


def uncompressed(kernel):
    """The ELF file in a bzImage, or that as it is where it is not compressed with xz."""
    start = kernel.find(b"\xfd7zXZ\0")
    return kernel if start < 0 else lzma.LZMADecompressor().decompress(kernel[start:])


def make_kernel(folder, version):
    """Modules of the initrd, each after those it needs."""
    package = folder / "package"
    run("apt-get", "download", "-qq", f"linux-image-{version}", cwd=folder)
    run("dpkg-deb", "-x", next(folder.glob("linux-image-*.deb")), package)
    (folder / "linux").write_bytes(uncompressed((package / "boot" / f"vmlinuz-{version}").read_bytes()))
    modules = package / "lib" / "modules" / version
    for build in (build_gpio_sim, build_v4l2loopback):
        shutil.copy(build(folder, version), modules / "kernel")
    run("depmod", "-b", package, version)

    def needed(names):
        order = []
        for name in names:
            shown = run("modprobe", "-d", package, "-S", version, "--show-depends", name)
            files = re.findall(r"^insmod (\S+)", shown, flags=re.M)
            order += [file for file in files if file not in order]
        return [pathlib.Path(file) for file in order]

    kept = folder / "kernel"
    for file in needed(MODULES):
        place = kept / file.relative_to(package)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, place)
    for name in ("modules.builtin", "modules.builtin.modinfo", "modules.order"):
        shutil.copy(modules / name, kept / modules.relative_to(package))
    run("depmod", "-b", kept, version)
    for_initrd = needed(INITRD_MODULES)
    make_initrd(folder, for_initrd)
    for deb in folder.glob("*.deb"):
        deb.unlink()
    for used in (package, folder / "gpio-sim", folder / "v4l2loopback"):
        shutil.rmtree(used)


def make_initrd(folder, modules):
    tree = pathlib.Path(tempfile.mkdtemp(dir=folder))
    (tree / "bin").mkdir()
    shutil.copy("/bin/busybox", tree / "bin" / "busybox")
    shutil.copy(HERE / "initrd_init.sh", tree / "init")
    (tree / "init").chmod(0o755)
    for number, module in enumerate(modules):
        shutil.copy(module, tree / f"{number:02}.ko")
    names = "\n".join(str(file.relative_to(tree)) for file in tree.rglob("*")) + "\n"
    with (folder / "initrd").open("wb") as initrd:
        subprocess.run(["cpio", "--quiet", "-o", "-H", "newc"], cwd=tree, input=names.encode(), stdout=initrd,
                       check=True)
    shutil.rmtree(tree)


def make_app(tree, target):
    """`tree`: an installation of the project and other files that are installed in the booted machine."""
    run("mksquashfs", tree, target, *SQUASH)
    os.truncate(target, APP_SIZE)  # the machine was booted with a disk of that size


def prepare_system(cached):
    """Folder with system.sqfs, made if missing; and whether the machine booted with it has been kept."""
    parts = sorted(file for file in [*(HERE / "guest").rglob("*"), HERE / "machine.py"] if file.is_file())
    recipe = [run("qemu-system-x86_64", "--version"), *NO_GENERATORS,
              *(f"{file.relative_to(HERE)} {file.read_text()}" for file in parts)]
    done = cached / f"system-{key_of(recipe)}"
    if not done.is_dir():
        for old in cached.glob("system-*"):
            shutil.rmtree(old)
        making = cached / "system.part"
        shutil.rmtree(making, ignore_errors=True)
        shutil.copytree(HERE / "guest", making / "tree", symlinks=True)
        shutil.copytree(cached / "kernel", making / "tree" / "usr", dirs_exist_ok=True)  # /lib is a link to usr/lib
        masks = making / "tree" / "etc" / "systemd" / "system-generators"
        masks.mkdir(parents=True)
        for name in NO_GENERATORS:
            (masks / f"systemd-{name}-generator").symlink_to("/dev/null")
        run("mksquashfs", making / "tree", making / "system.sqfs", *SQUASH)
        shutil.rmtree(making / "tree")
        making.rename(done)
    return done, (done / "booted").is_file()


def key_of(recipe):
    return hashlib.sha256("\n".join(recipe).encode()).hexdigest()[:12]


def prepare(cache, programs):
    """Folder with base.sqfs, linux, initrd and kernel/, made if missing; and whether it was."""
    version = kernel_version()
    packages = SYSTEM_PACKAGES + library_packages(programs)
    recipe = [version, *packages, pathlib.Path(__file__).read_text(), (HERE / "initrd_init.sh").read_text()]
    key = key_of(recipe)
    done = cache / key
    if done.is_dir():
        return done, True
    shutil.rmtree(cache, ignore_errors=True)  # of another recipe, or left by an interrupted run
    making = cache / f"{key}.part"
    making.mkdir(parents=True)
    make_kernel(making, version)
    make_base(making, packages)
    making.rename(done)
    return done, False
