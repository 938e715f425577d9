#!/usr/bin/python3
"""tools/vm/vcan_vm.py: status and output come out, faults have names. Boots the guest a few times."""

from __future__ import annotations

import subprocess
import tempfile
import unittest
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[3]
PROGRAM = REPOSITORY / "tools/vm/vcan_vm.py"


def vm(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([PROGRAM, *arguments], cwd=REPOSITORY, capture_output=True, text=True,
                          check=False)


class WithoutGuest(unittest.TestCase):
    def test_help(self) -> None:
        done = vm("--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("COMMAND", done.stdout)

    def test_usage(self) -> None:
        for arguments in ([], ["--"], ["--env", "X", "--", "true"],
                          ["--writable", "/nowhere", "--", "true"]):
            done = vm(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn("usage:", done.stderr)


class WithGuest(unittest.TestCase):
    def test_status_output_and_vcan(self) -> None:
        with tempfile.TemporaryDirectory(dir=REPOSITORY / "build") as folder:
            script = (f"pwd; echo $WORD; cat /sys/class/net/vcan0/mtu; echo scratch >$TMPDIR/x; "
                      f"echo kept >{folder}/y; touch {REPOSITORY}/z; "
                      "ip link set vcan0 down && ip link set vcan0 up && "
                      "tc qdisc add dev vcan0 root tbf rate 500kbit burst 64 limit 640 && exit 42")
            done = vm("--env", "WORD=it's here", "--writable", folder, "--", "sh", "-c", script)
            self.assertEqual((Path(folder) / "y").read_text(), "kept\n")
        lines = done.stdout.splitlines()
        self.assertEqual(lines[:3], [str(REPOSITORY), "it's here", "72"])
        self.assertIn("Read-only file system", done.stdout)
        self.assertFalse((REPOSITORY / "z").exists())
        self.assertEqual(done.returncode, 42, done.stderr)
        self.assertIn("status 42", done.stderr)

    def test_much_output_comes_out_whole(self) -> None:
        done = vm("--quiet", "--", "seq", "20000")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.split(), [str(number) for number in range(1, 20001)])
        self.assertEqual(done.stderr, "")

    def test_timeout(self) -> None:
        done = vm("--timeout", "12", "--", "sh", "-c", "echo before; sleep 100")
        self.assertEqual(done.returncode, 124)
        self.assertIn("no end after 12 s", done.stderr)

    def test_guest_that_dies(self) -> None:
        done = vm("--", "sh", "-c", "echo o >/proc/sysrq-trigger; sleep 100")
        self.assertEqual(done.returncode, 125)
        self.assertIn("without running the command to its end", done.stderr)


if __name__ == "__main__":
    unittest.main()
