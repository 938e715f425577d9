#!/usr/bin/python3
"""The klingel command: help, arguments good and bad, output files.

usage: KLINGEL=build/klingel python3 tests/tools/test_cli.py [-v]
"""

from __future__ import annotations

import os
import pathlib
import random
import re
import signal
import subprocess
import time
import unittest

from cli import ARCS, COMMANDS, CREEP, DEMO, FREE, KLINGEL, RESTRAINED, ROOT, WAGON, InFolder, klingel, output

SEED = 20260103
# what each command needs at least, ending quickly
LEAST = {
    "sketch": (FREE, "-o", "-"),
    "geometry": (FREE,),
    "conicity": (FREE,),
    "creep": (CREEP, "--rows", "2"),
    "run": (RESTRAINED, "--speed", "10", "--time", "0.01"),
    "modes": (RESTRAINED, "--speed", "10"),
    "critical": (RESTRAINED, "--linear"),
    "ride": (WAGON, DEMO, "--speed", "27", "--to", "150"),
    "curve": (WAGON, "--radius", "1000", "--speed", "30"),
    "bench": (RESTRAINED, "--steps", "1000"),
    "hil": (RESTRAINED, "--bus", "socketcand:0", "--time", "0.01", "--priority", "0"),
    "dbc": (RESTRAINED,),
    "signals": (RESTRAINED,),
    "build": (RESTRAINED, "-o", "-"),
}
OPERAND = {"creep": "TABLE"}  # of those that take no MODEL
NUMBERS = {
    "geometry": ("--every", "--wheel-load"),
    "creep": ("--a", "--b", "--load", "--to", "--along", "--across", "--spin", "--rows", "--friction", "--speed"),
    "conicity": ("--from", "--to", "--step", "--at", "--base", "--radius"),
    "run": ("--speed", "--time", "--speed-to", "--from", "--every"),
    "modes": ("--speed", "--shapes", "--at"),
    "ride": ("--speed", "--from", "--to", "--assess-from", "--section", "--floor", "--step"),
    "curve": ("--speed", "--cant", "--cant-deficiency", "--cant-base", "--settle"),
    "critical": ("--step", "--disturbance", "--settle", "--tolerance", "--near", "--at"),
    "bench": ("--steps", "--speed"),
    "hil": ("--speed", "--from", "--time", "--priority", "--cpu", "--state-divider", "--bit-rate"),
    "dbc": ("--state-divider",),
    "signals": ("--state-divider",),
}


class Temporary(InFolder):
    def assert_misuse(self, *arguments: object, says: str = "") -> None:
        """Status 2, nothing on standard output, one message that names what is wrong."""
        done = klingel(*arguments)
        with self.subTest(arguments=arguments):
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, r"^klingel( \w+)?: ")
            self.assertIn("--help", done.stderr)
            self.assertIn(says, done.stderr)


class Help(Temporary):
    def test_every_command_explains_itself(self) -> None:
        top = output("--help")
        for command in COMMANDS:
            with self.subTest(command=command):
                self.assertIn(f"  {command} ", top)
                text = output(command, "--help")
                self.assertTrue(text.startswith(f"usage: klingel {command} {OPERAND.get(command, 'MODEL')}"))
                self.assertIn("example:\n  klingel " + command, text)
                self.assertEqual(text, output("help", command))
                self.assertLess(max(map(len, text.splitlines())), 100)

    def test_help_wins_over_errors(self) -> None:
        self.assertIn("usage:", output("run", "nowhere.yaml", "--nonsense", "--help"))

    def test_every_option_is_described_and_understood(self) -> None:
        for command in COMMANDS:
            for option in re.findall(r"^  (?:-o, )?(--[a-z-]+)", output(command, "--help"), re.M):
                done = klingel(command, "nowhere.yaml", option)
                with self.subTest(command=command, option=option):
                    self.assertNotIn("unknown option", done.stderr)

    def test_version(self) -> None:
        self.assertRegex(output("--version"), r"^klingel \d+\.\d+\.\d+\n$")


class Arguments(Temporary):
    def test_the_least_works(self) -> None:
        for command in COMMANDS:
            with self.subTest(command=command):
                self.assertNotEqual(output(command, *LEAST[command]), "")

    def test_commands(self) -> None:
        self.assert_misuse(says="command is missing")
        self.assert_misuse("geometri", says="did you mean geometry?")
        self.assert_misuse("xyzzy", says="unknown command xyzzy")
        self.assert_misuse("", says="unknown command")

    def test_unknown_options_get_a_suggestion(self) -> None:
        for command, wrong, right in (("run", "--sped", "--speed"), ("run", "--final-hsh", "--final-hash"),
                                      ("modes", "--crtical", "--critical"), ("hil", "--buss", "--bus"),
                                      ("geometry", "--cvs", "--csv"), ("bench", "--instruction", "--instructions")):
            self.assert_misuse(command, *LEAST[command], wrong, says=f"unknown option {wrong}; did you mean {right}?")
            self.assert_misuse(command, *LEAST[command], wrong + "=1", says=f"did you mean {right}?")
        self.assert_misuse("run", *LEAST["run"], "--qqqqqqqqqq", says="unknown option --qqqqqqqqqq\n")
        self.assert_misuse("run", *LEAST["run"], "-x", says="unknown option -x")

    def test_missing_things(self) -> None:
        for command in COMMANDS:
            self.assert_misuse(command, says=f"an argument is missing: expected {OPERAND.get(command, 'MODEL')}")
        self.assert_misuse("run", RESTRAINED, "--time", "1", says="--speed V is missing")
        self.assert_misuse("run", RESTRAINED, "--speed", "1", says="--time T is missing")
        self.assert_misuse("modes", RESTRAINED, says="one of --speed, --speeds and --critical")
        self.assert_misuse("build", RESTRAINED, says="-o FILE is missing")
        for option in ("--speed", "--time", "--csv=", "--set", "--initial"):
            self.assert_misuse("run", *LEAST["run"], option, says=option.rstrip("="))
        self.assert_misuse("run", RESTRAINED, "--speed", "--time", "1", says="--speed needs a value: V")
        self.assert_misuse("build", RESTRAINED, "-o", "--name", "x", says="--output needs a value")

    def test_too_many_arguments(self) -> None:
        self.assert_misuse("run", *LEAST["run"], DEMO, "third", says="'third' is one argument too many")
        self.assert_misuse("geometry", FREE, DEMO, says="one argument too many")
        self.assert_misuse("run", *LEAST["run"], "--final-hash=yes", says="takes no value")

    def test_numbers(self) -> None:
        bad = ("nan", "NaN", "inf", "-inf", "infinity", "1e999", "-1e999", "0x10", "ten", "", " ", "1,5", "--1", "1e",
               "5parsecs", "3 m/s/s", "1e308", "-1e308", "+", "-", ".", "e5", "١", "1\n2", "$(ls)", "%n%s")
        for command, options in NUMBERS.items():
            for i, option in enumerate(options):  # all numbers are read by the same function
                for number in bad if i == 0 else bad[:1] + bad[8:16:3]:
                    self.assert_misuse(command, *LEAST[command], f"{option}={number}", says=option)

    def test_ranges_name_what_is_allowed(self) -> None:
        for arguments, says in (
                (("run", RESTRAINED, "--time", "1", "--speed", "150.01"), "--speed 150.01: must be within 0..150 m/s"),
                (("run", RESTRAINED, "--time", "1", "--speed", "-1"), "--speed -1: must be within 0..150 m/s"),
                (("run", RESTRAINED, "--time", "1", "--speed", "541km/h"), "must be within 0..150 m/s"),
                (("run", RESTRAINED, "--time", "1", "--speed", "5kg"), "must be one of m/s mm/s km/h"),
                (("run", RESTRAINED, "--time", "-1", "--speed", "1"), "--time -1: must be within 0..1e+09 s"),
                (("run", *LEAST["run"], "--every", "0"), "--every 0: must be a whole number within 1.."),
                (("run", *LEAST["run"], "--every", "1.5"), "must be a whole number"),
                (("run", *LEAST["run"], "--every", "99999999999999999999"), "must be a whole number"),
                (("hil", *LEAST["hil"], "--clock", "sundial"), "must be one of realtime|lockstep"),
                (("hil", *LEAST["hil"], "--policy", "skipp"), "must be one of skip|catch-up|halt"),
                (("hil", *LEAST["hil"], "--policy", "skip|halt"), "must be one of skip|catch-up|halt"),
                (("hil", RESTRAINED, "--bus", "socketcand:99999"), "the port must be within 0..65535"),
                (("hil", RESTRAINED, "--bus", "socketcand:-1"), "the port must be within 0..65535"),
                (("modes", RESTRAINED, "--speeds", "10:20"), "must be A:B:STEP"),
                (("modes", RESTRAINED, "--speeds", "10:20:0"), "the step must be positive"),
                (("modes", RESTRAINED, "--speeds", "10:20:1e-9"), "the speeds at most"),
                (("modes", RESTRAINED, "--speeds", "20:10:1"), "speeds must rise within"),
                (("modes", RESTRAINED, "--speeds", "0:10:1"), "speeds must rise within 0.1..150 m/s"),
                (("modes", RESTRAINED, "--speeds", "10:x:1"), "'x' must be a number"),
                (("modes", RESTRAINED, "--critical", "10:200"), "speeds must rise within 0.1..150 m/s"),
                (("modes", RESTRAINED, "--critical", "1:2:3"), "must be LOW:HIGH"),
                (("modes", RESTRAINED, "--speed", "1", "--speeds", "1:2:1"), "exclude each other"),
                (("geometry", ARCS, "--solve", "9"), "must be within the table of pair arcs, -8..8 mm"),
                (("geometry", ARCS, "--wheel-load", "3mm"), "--wheel-load 3mm: the unit must be one of N kN"),
                (("geometry", ARCS, "--wheel-load", "50kN", "--plot", "x.png"), "--plot shows rigid contacts"),
                (("geometry", ARCS, "--solve", "x"), "--solve x: must be a number of mm"),
                (("geometry", ARCS, "--pair", "arc"), "no such pair; did you mean arcs"),
                (("build", RESTRAINED, "-o", "-", "--name", "9lives"), "--name 9lives: must be a C name"),
                (("build", RESTRAINED, "-o", "-", "--name", "while"), "must be a C name"),
                (("build", RESTRAINED, "-o", "-", "--name", "kl_step"), "must be a C name"),
                (("build", RESTRAINED, "-o", "-", "--name", "a;b"), "must be a C name"),
                (("build", RESTRAINED, "-o", "-", "--name", "a" * 32), "must be a C name")):
            self.assert_misuse(*arguments, says=says)

    def test_initial(self) -> None:
        base = ("run", WAGON, "--speed", "10", "--time", "0")
        for text, says in (("front.y", "must be PART.COORDINATE=VALUE"), ("y=1mm", "must be PART.COORDINATE=VALUE"),
                           ("=1", "must be PART.COORDINATE=VALUE"), ("frnt.y=1mm", "did you mean front"),
                           ("front.z=1mm", "front has these: y yaw y_rate yaw_rate spin"),
                           ("body.spin=1", "body has these: y yaw z roll pitch"), ("front.y=1deg", "must be one of m mm km"),
                           ("front.y=", "must be a number of m"), ("front.y=nan", "must be a number of m")):
            self.assert_misuse(*base, "--initial", text, says=says)
        many = [word for _ in range(65) for word in ("--initial", "front.y=1mm")]
        self.assert_misuse(*base, *many, says="given more than 64 times")

    def test_forms_of_the_same(self) -> None:
        base = ("run", RESTRAINED, "--time", "1", "--final-hash", "--initial", "wheelset.y=2mm")
        one = output(*base, "--speed", "20")
        for speed in (("--speed=20",), ("--speed", "72km/h"), ("--speed", "72 km/h"), ("--speed", "2e1"), ("--speed", "+20m/s")):
            self.assertEqual(output(*base, *speed), one)
        self.assertEqual(output("run", "--speed", "20", "--time", "1000ms", "--final-hash", "--initial=wheelset.y=0.002",
                                "--", RESTRAINED), one)
        self.assertNotEqual(output(*base, "--speed", "21"), one)

    def test_files_that_cannot_be_read(self) -> None:
        (self.folder / "empty.yaml").write_text("")
        (self.folder / "binary.yaml").write_bytes(bytes(range(256)))
        for command in COMMANDS:
            for name in (self.folder / "none.yaml", self.folder, self.folder / "empty.yaml", self.folder / "binary.yaml"):
                done = klingel(command, name, *LEAST[command][1:])
                with self.subTest(command=command, name=name):
                    self.assertEqual((done.returncode, done.stdout), (1, ""))
                    self.assertIn(name.name, done.stderr)

    def test_a_profile_that_cannot_be_built_names_its_line(self) -> None:
        for command in ("geometry", "run", "modes"):
            done = klingel(command, "tests/tools/bad/build_profile_end.yaml", *LEAST[command][1:])
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertRegex(done.stderr, r"^tests/tools/bad/build_profile_end\.yaml:\d+: pairs")

    def test_set(self) -> None:
        for assignment, status in (("mass=1", 1), ("", 2), ("wheelsets[0].mass_kg", 1), ("wheelsets[0].mass_kg=-1", 1),
                                   ("wheelsets[0].mass_kg=1300", 0), ("track.name=x", 1), ("=1", 1)):
            done = klingel("run", *LEAST["run"], f"--set={assignment}")
            with self.subTest(assignment=assignment):
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertEqual(done.stderr == "", status == 0)

    def test_garbage_never_crashes(self) -> None:
        """Random words in random places: a status of 0, 1 or 2, a message if not 0, no half-written file."""
        source = random.Random(SEED)
        words = ["--speed", "--time", "--csv", "--set", "--initial", "--every", "--solve", "--pair", "--speeds", "--at",
                 "--critical", "--final-hash", "--output", "-o", "--name", "--json", "--steps", "--state-divider", "--from",
                 "--", "-", "-1", "0", "1e-3", "nan", "1:2:1", "9" * 400, "x=y", "wheelset.y=1mm", "%s%n", "\x1b[2J", "é",
                 "--=", "=", "--speed=", "a" * 5000, "tests/tools/bad/typo.yaml", RESTRAINED, "wheelset"]
        commands = [c for c in COMMANDS if c not in ("hil", "bench")]
        for i in range(300):
            command = source.choice(commands)
            line = [source.choice(words) for _ in range(source.randrange(1, 6))]
            line = [w for w in line if w not in ("--csv", "--output", "-o", "--json")] if i % 2 else line
            done = subprocess.run([str(KLINGEL), command, str(ROOT / RESTRAINED), *line], cwd=self.folder, timeout=60,
                                  capture_output=True, check=False)
            with self.subTest(command=command, line=line, seed=SEED):
                self.assertIn(done.returncode, (0, 1, 2), done.stderr)
                self.assertEqual(done.returncode != 0, b"klingel" in done.stderr or b".yaml" in done.stderr or
                                 b"cannot set" in done.stderr or b"cannot open" in done.stderr)
                self.assertNotIn(b"\x1b", done.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if re.search(r"\.\w{6}$", p.name)], [])


class OutputFiles(Temporary):
    def test_csv_to_file_and_to_standard_output(self) -> None:
        path = self.folder / "out.csv"
        base = ("run", WAGON, "--speed", "10", "--time", "0.1")
        text = output(*base, "--csv", path)
        self.assertIn("extremes", text)
        self.assertEqual(path.read_text(), output(*base, "--csv"))
        self.assertEqual(path.read_text(), output(*base, "--csv", "-"))
        self.assertEqual(len(path.read_text().splitlines()), 102)
        self.assertEqual(os.listdir(self.folder), ["out.csv"])

    def test_permissions_links_and_devices(self) -> None:
        path, link = self.folder / "out.csv", self.folder / "link.csv"
        base = ("dbc", RESTRAINED, "-o")
        output(*base, path)
        mask = os.umask(0)
        os.umask(mask)
        self.assertEqual(path.stat().st_mode & 0o777, 0o666 & ~mask)
        path.chmod(0o640)
        link.symlink_to(path)
        output(*base, link)
        self.assertTrue(link.is_symlink())
        self.assertEqual(path.stat().st_mode & 0o777, 0o640)
        output(*base, "/dev/null")
        self.assertTrue(pathlib.Path("/dev/null").is_char_device())

    def test_a_failure_leaves_the_old_file(self) -> None:
        path = self.folder / "old.c"
        path.write_text("old")
        done = klingel("build", "tests/tools/bad/typo.yaml", "-o", path)
        self.assertEqual((done.returncode, path.read_text()), (1, "old"))
        self.assertEqual(os.listdir(self.folder), ["old.c"])

    def test_no_space_and_no_folder(self) -> None:
        for command, option in (("run", "--csv"), ("geometry", "--csv"), ("modes", "--csv"), ("build", "-o"), ("dbc", "-o"),
                                ("signals", "-o"), ("bench", "--json")):
            base = [w for w in LEAST[command] if w not in ("-o", "-")]
            full = klingel(command, *base, option, "/dev/full")
            nowhere = klingel(command, *base, option, "/nowhere/at/all.txt")
            folder = klingel(command, *base, option, self.folder)
            with self.subTest(command=command):
                self.assertEqual((full.returncode, nowhere.returncode, folder.returncode), (1, 1, 1))
                self.assertIn("No space left", full.stderr)
                self.assertIn("/nowhere/at/all.txt: No such file", nowhere.stderr)
                self.assertIn("Is a directory", folder.stderr)

    def test_standard_output_full(self) -> None:
        with open("/dev/full", "w", encoding="ascii") as full:
            for command in COMMANDS:
                done = subprocess.run([str(KLINGEL), command, *LEAST[command]], cwd=ROOT, stdout=full, timeout=60,
                                      stderr=subprocess.PIPE, text=True, check=False)
                with self.subTest(command=command):
                    self.assertEqual(done.returncode, 1)
                    self.assertRegex(done.stderr, "standard output|no picture")

    def test_models_are_not_written_over(self) -> None:
        path = self.folder / "model.yaml"
        path.write_text((ROOT / RESTRAINED).read_text())
        before = path.read_text()
        self.assert_misuse("run", RESTRAINED, "--speed", "1", "--time", "1", "--csv", path, says="not be written over")
        self.assert_misuse("dbc", path, "-o", path, says="not be written over")
        self.assertEqual(path.read_text(), before)

    def test_interrupted_leaves_nothing(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            process = subprocess.Popen([str(KLINGEL), "run", WAGON, "--speed", "10", "--time", "1e5", "--csv",
                                        str(self.folder / "x.csv")], cwd=ROOT, stdout=subprocess.DEVNULL)
            until = time.monotonic() + 10
            while not os.listdir(self.folder) and time.monotonic() < until:
                time.sleep(0.01)
            self.assertNotEqual(os.listdir(self.folder), [])
            process.send_signal(number)
            self.assertEqual(process.wait(timeout=10), -number)
            self.assertEqual(os.listdir(self.folder), [])

    def test_a_closed_pipe_ends_it(self) -> None:
        process = subprocess.Popen([str(KLINGEL), "run", WAGON, "--speed", "10", "--time", "1e6", "--csv", "-"], cwd=ROOT,
                                   stdout=subprocess.PIPE)
        process.stdout.readline()
        process.stdout.close()
        self.assertEqual(process.wait(timeout=20), -signal.SIGPIPE)


if __name__ == "__main__":
    unittest.main()
