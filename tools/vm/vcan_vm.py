#!/usr/bin/python3
"""Run a command where there is a real vcan0: under Debian's own kernel in a QEMU guest.

For machines whose kernel has no CAN. The guest sees the host's / read-only over 9p, /tmp and /run as
scratch in memory, and vcan0 up with mtu 72 (FD). The command runs there as root in the same
directory, so that it may take vcan0 down and up or put `tc` queues on it. Its output appears here,
its exit status becomes this program's.

The guest is emulated (no KVM is needed or used): about ten times slower than the host. Never quote a
timing from it.
"""

from __future__ import annotations

import argparse
import lzma
import os
import platform
import re
import select
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

META_PACKAGE = "linux-image-amd64"
# In the order in which they have to be loaded; those that a kernel has built in are passed over.
MODULES = """virtio_ring virtio virtio_pci_modern_dev virtio_pci_legacy_dev virtio_pci netfs fscache
9pnet 9pnet_virtio 9p can can-raw can-bcm can-gw can-dev vcan slcan vxcan sch_tbf sch_netem""".split()
PROGRAMS = {
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "cpio": "cpio",
    "dpkg-deb": "dpkg",
    "ip": "iproute2",
}
STATUS_TIMEOUT = 124
STATUS_BROKEN = 125

# Three serial ports: ttyS0 the kernel's console, ttyS1 the command's output, ttyS2 what became of it.
INIT = """#!/bin/busybox sh
export PATH=/bin
/bin/busybox --install -s /bin
fail() { echo "vcan_vm: $*" >/dev/ttyS2; poweroff -f; }
mount -t devtmpfs dev /dev
mount -t proc proc /proc
mount -t sysfs sys /sys
stty -F /dev/ttyS1 raw
stty -F /dev/ttyS2 raw
for module in $(cat /modules/order); do
    insmod "/modules/$module" || fail "the guest's kernel refuses the module $module"
done
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose,ro host /host || fail "no 9p"
mount -t proc proc /host/proc
mount -t sysfs sys /host/sys
mount -t devtmpfs dev /host/dev
mkdir -p /host/dev/pts /host/dev/shm
mount -t devpts devpts /host/dev/pts
mount -t tmpfs tmpfs /host/dev/shm
mount -t tmpfs tmpfs /host/run
mkdir -m 1777 /host/run/scratch
cp /job /host/run/job
. /mounts
chroot /host /bin/sh -c 'ip link set lo up && ip link add dev vcan0 type vcan &&
    ip link set vcan0 mtu 72 && ip link set vcan0 up' >/dev/ttyS2 2>&1 || fail "no vcan0"
chroot /host /bin/sh /run/job </dev/null >/dev/ttyS1 2>&1
echo "status $?" >/dev/ttyS2
sync
poweroff -f
"""


class Trouble(Exception):
    """Something the user can do something about."""


def say(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        print(f"vcan_vm: {text}", file=sys.stderr, flush=True)


def check_host() -> None:
    if platform.machine() != "x86_64":
        raise Trouble(f"this needs an x86-64 host, not {platform.machine()}")
    missing = sorted({package for name, package in PROGRAMS.items() if shutil.which(name) is None})
    if missing:
        raise Trouble("please install: apt-get install " + " ".join(missing))


def capture(*command: str, cwd: Path | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise Trouble(f"{shlex.join(command)}: {last}")
    return done.stdout


def download_kernel(options: argparse.Namespace) -> Path:
    """Fetches the package that the meta package stands for; returns the .deb."""
    depends = capture("apt-cache", "depends", META_PACKAGE)
    names = re.findall(r"Depends: (linux-image-\S+)", depends)
    if not names:
        raise Trouble(f"apt does not know {META_PACKAGE}; run `apt-get update` first")
    say(options, f"downloading {names[0]} (once, about 70 MB)")
    # apt-get download wants a directory that its own user may write to; a private one is moved from.
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        capture("apt-get", "-qq", "download", names[0], cwd=Path(folder))
        debs = list(Path(folder).glob("*.deb"))
        if len(debs) != 1:
            raise Trouble(f"apt-get download {names[0]} left {len(debs)} packages")
        return Path(shutil.move(str(debs[0]), options.cache / debs[0].name))


def unpack_kernel(deb: Path, kernel: Path) -> None:
    """Takes the kernel and the modules we load out of the package; nothing else is kept."""
    building = kernel.with_name(kernel.name + ".new")
    shutil.rmtree(building, ignore_errors=True)
    building.mkdir()
    builtin = ""
    with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", deb], stdout=subprocess.PIPE) as unpacker:
        with tarfile.open(fileobj=unpacker.stdout, mode="r|") as archive:
            for member in archive:
                name = Path(member.name).name
                stem = re.sub(r"\.ko(\.xz)?$", "", name)
                if not member.isfile():
                    continue
                if name.startswith("vmlinuz-"):
                    (building / "vmlinuz").write_bytes(archive.extractfile(member).read())
                elif name == "modules.builtin":
                    builtin = archive.extractfile(member).read().decode()
                elif stem in MODULES and stem != name:
                    content = archive.extractfile(member).read()
                    content = lzma.decompress(content) if name.endswith(".xz") else content
                    (building / f"{stem}.ko").write_bytes(content)
    if unpacker.returncode != 0 or not (building / "vmlinuz").exists():
        raise Trouble(f"{deb} is damaged; delete it and try again")
    missing = [name for name in MODULES
               if not (building / f"{name}.ko").exists() and f"/{name}.ko" not in builtin]
    if missing:
        raise Trouble(f"{deb.name} lacks the modules " + " ".join(missing))
    building.rename(kernel)


def find_kernel(options: argparse.Namespace) -> Path:
    """The folder with vmlinuz and the modules; fetched if it is not there yet."""
    options.cache.mkdir(parents=True, exist_ok=True)
    kernel = options.cache / "kernel"
    if not (kernel / "vmlinuz").exists():
        debs = sorted(options.cache.glob("linux-image-*.deb"))
        deb = debs[-1] if debs else download_kernel(options)
        say(options, f"unpacking {deb.name}")
        unpack_kernel(deb, kernel)
        deb.unlink()
    return kernel


def job_script(options: argparse.Namespace, scratch: str) -> str:
    keep = {name: os.environ[name] for name in ("PATH", "HOME", "USER") if name in os.environ}
    keep.update(LC_ALL="C.UTF-8", TMPDIR=scratch, KLINGEL_VM="1")
    keep.update(pair.split("=", 1) for pair in options.env)
    lines = [f"export {name}={shlex.quote(value)}" for name, value in keep.items()]
    lines.append(f"cd {shlex.quote(os.getcwd())} || exit {STATUS_BROKEN}")
    lines.append(f"exec {shlex.join(options.command)}")
    return "\n".join(lines) + "\n"


def build_initramfs(options: argparse.Namespace, kernel: Path, folder: Path) -> Path:
    """busybox, the modules, /init and the job, as one small archive."""
    root = folder / "root"
    for name in ("bin", "dev", "proc", "sys", "host", "modules"):
        (root / name).mkdir(parents=True)
    shutil.copy(shutil.which("busybox"), root / "bin/busybox")
    present = [f"{name}.ko" for name in MODULES if (kernel / f"{name}.ko").exists()]
    for name in present:
        shutil.copy(kernel / name, root / "modules" / name)
    (root / "modules/order").write_text("\n".join(present) + "\n")

    # /tmp becomes scratch too, unless what we work on lives there.
    here = [Path.cwd(), options.cache] + options.writable
    tmp_is_ours = any(Path("/tmp") in [place, *place.parents] for place in here)
    mounts = [] if tmp_is_ours else ["mount -t tmpfs tmpfs /host/tmp"]
    for number, place in enumerate(options.writable):
        mounts.append(f"mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 rw{number} "
                      f"{shlex.quote('/host' + str(place))} || fail no {shlex.quote(str(place))}")
    (root / "mounts").write_text("\n".join(mounts) + "\n")
    (root / "job").write_text(job_script(options, "/run/scratch" if tmp_is_ours else "/tmp"))
    (root / "init").write_text(INIT)
    (root / "init").chmod(0o755)

    archive = folder / "initramfs"
    names = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    with archive.open("wb") as out:
        subprocess.run(["cpio", "--quiet", "-o", "-H", "newc"], cwd=root, input=names.encode(),
                       stdout=out, check=True)
    return archive


def qemu_command(options: argparse.Namespace, kernel: Path, folder: Path) -> list[str]:
    command = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "2",
               "-m", str(options.memory), "-nodefaults", "-no-user-config", "-no-reboot",
               "-display", "none",
               "-chardev", f"file,id=console,path={folder}/console", "-serial", "chardev:console",
               "-chardev", "stdio,id=output,signal=off", "-serial", "chardev:output",
               "-chardev", f"file,id=status,path={folder}/status", "-serial", "chardev:status",
               "-kernel", str(kernel / "vmlinuz"), "-initrd", str(folder / "initramfs"),
               "-append", "console=ttyS0 quiet panic=-1",
               "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,"
                          "multidevs=remap"]
    for number, place in enumerate(options.writable):
        command += ["-virtfs", f"local,path={place},mount_tag=rw{number},security_model=none,"
                               "multidevs=remap"]
    return command


def pass_on_output(guest: subprocess.Popen, deadline: float) -> bool:
    """Copies the guest's output as it comes, to its end; False if the time is over first."""
    while (left := deadline - time.monotonic()) > 0:
        if select.select([guest.stdout], [], [], left)[0]:
            chunk = os.read(guest.stdout.fileno(), 65536)
            if not chunk:
                return True
            sys.stdout.buffer.write(chunk)
            sys.stdout.buffer.flush()
    return False


def run_guest(options: argparse.Namespace, kernel: Path, folder: Path) -> int:
    build_initramfs(options, kernel, folder)
    say(options, f"booting the guest for: {shlex.join(options.command)}")
    began = time.monotonic()
    # QEMU makes the files it writes to non-blocking: it gets a pipe, and not our own output.
    with subprocess.Popen(qemu_command(options, kernel, folder), stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE) as guest:
        try:
            if not pass_on_output(guest, began + options.timeout):
                print(f"vcan_vm: no end after {options.timeout:g} s; the guest was switched off",
                      file=sys.stderr)
                return STATUS_TIMEOUT
        finally:
            guest.kill()  # of no effect where it has ended by itself
    told = (folder / "status").read_text(errors="replace").strip()
    match = re.search(r"^status (\d+)\s*$", told, re.MULTILINE)
    if match is None:
        console = (folder / "console").read_text(errors="replace").strip().splitlines()[-20:]
        raise Trouble("the guest ended without running the command to its end\n  "
                      + "\n  ".join([told] + console))
    say(options, f"status {match[1]}, {time.monotonic() - began:.0f} s with the boot")
    return int(match[1])


def parse(arguments: list[str]) -> argparse.Namespace:
    repository = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="%(prog)s [options] -- COMMAND [ARGUMENT ...]",
        epilog=f"exit status: the command's; {STATUS_TIMEOUT} timeout; {STATUS_BROKEN} the guest "
               "could not be started or died")
    parser.add_argument("--cache", type=Path, default=repository / "build/vm", metavar="DIR",
                        help="where the kernel is kept (default: build/vm of the repository)")
    parser.add_argument("--timeout", type=float, default=300.0, metavar="S",
                        help="seconds for boot and command together (default: %(default)g)")
    parser.add_argument("--memory", type=int, default=1024, metavar="MB",
                        help="memory of the guest (default: %(default)d)")
    parser.add_argument("--env", action="append", default=[], metavar="NAME=VALUE",
                        help="set a variable for the command; may be given more than once")
    parser.add_argument("--writable", type=Path, action="append", default=[], metavar="DIR",
                        help="a directory of the host that the command may write to; "
                             "may be given more than once")
    parser.add_argument("--fetch", action="store_true",
                        help="only fetch and unpack the kernel, if it is not there yet")
    parser.add_argument("--quiet", action="store_true", help="no progress messages")
    parser.add_argument("command", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.command[:1] == ["--"]:
        del options.command[0]
    if not options.command and not options.fetch:
        parser.error("no command given")
    if any("=" not in pair for pair in options.env):
        parser.error("--env wants NAME=VALUE")
    options.cache = options.cache.resolve()
    options.writable = [place.resolve() for place in options.writable]
    for place in options.writable:
        if not place.is_dir():
            parser.error(f"{place} is not a directory")
    return options


def main(arguments: list[str]) -> int:
    options = parse(arguments)
    try:
        check_host()
        kernel = find_kernel(options)
        if options.fetch:
            return 0
        with tempfile.TemporaryDirectory(prefix="run-", dir=options.cache) as folder:
            return run_guest(options, kernel, Path(folder))
    except (Trouble, OSError, subprocess.SubprocessError) as trouble:
        print(f"vcan_vm: {trouble}", file=sys.stderr)
        return STATUS_BROKEN
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
