"""The machines that Klingel is compiled for and run on in tests: compilers, flags, and how to run a program.

Processors of other kinds are emulated: qemu-user for Linux programs, qemu-system-arm for the Cortex-M of Arm's MPS2
board, where a test program has main(argc, argv) and stdio over semihosting (tests/target/semihosting.c).
"""

from __future__ import annotations

import dataclasses
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[1]
STRICT = "-std=c11 -ffp-contract=off -fno-fast-math -fno-math-errno -fno-trapping-math".split()
WARN = "-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wvla -Werror".split()


@dataclasses.dataclass(frozen=True)
class Target:
    name: str
    compilers: dict[str, list[str]]  # by name: command and flags of the target
    prefix: str = ""  # of nm and size
    start: tuple[str, ...] = ()  # sources that a program needs besides its own
    link: tuple[str, ...] = ()
    emulator: tuple[str, ...] = ()  # in front of a Linux program
    machine: str = ""  # of qemu-system-arm

    def command(self, program: pathlib.Path, arguments: list[str], more: list[str] | None = None) -> list[str]:
        """What runs a program here; `more`: further options for QEMU."""
        if not self.machine:
            return [*self.emulator, str(program), *arguments]
        words = ",".join(f"arg={word}" for word in [program.name, *arguments])
        return ["qemu-system-arm", "-machine", self.machine, "-display", "none", "-monitor", "none", "-serial", "none",
                "-semihosting-config", f"enable=on,target=native,{words}", *(more or []), "-kernel", str(program)]


# gcc's scheduling before it gives out registers, and what it moves out of branches, only make it spill doubles there
SPARE_REGISTERS = "-fno-schedule-insns -fno-tree-pre".split()

# how the firmware is linked: the many small functions of a step together
TOGETHER = ["-flto"]


def _cortex(name: str, machine: str, flags: str) -> Target:
    # enums are as short as can be there: checks for a negative one are always false, and right elsewhere
    command = ["arm-none-eabi-gcc", "-mthumb", *flags.split(), *SPARE_REGISTERS, "-Wno-type-limits"]
    return Target(name, {"gcc": command}, "arm-none-eabi-",
                  ("port/mps2/startup.c", "port/mps2/soft_double.c", "tests/target/semihosting.c"),
                  ("-Iport/mps2", "-DMPS2_ENTRY=target_entry", "-nostartfiles", "--specs=rdimon.specs", "-T",
                   "port/mps2/mps2.ld", "-Wl,--defsym=STACK_BYTES=131072"), machine=machine)


TARGETS = {target.name: target for target in (
    Target("x86-64", {"gcc": ["gcc"], "clang": ["clang"]}),
    Target("aarch64", {"gcc": ["aarch64-linux-gnu-gcc"], "clang": ["clang", "--target=aarch64-linux-gnu"]},
           "aarch64-linux-gnu-", link=("-static",), emulator=("qemu-aarch64",)),
    Target("riscv64", {"gcc": ["riscv64-linux-gnu-gcc"], "clang": ["clang", "--target=riscv64-linux-gnu"]},
           "riscv64-linux-gnu-", link=("-static",), emulator=("qemu-riscv64",)),
    _cortex("cortex-m7", "mps2-an500", "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard"),
    _cortex("cortex-m4", "mps2-an386", "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard"),
    _cortex("cortex-m3", "mps2-an385", "-mcpu=cortex-m3 -mfloat-abi=soft"),
)}
