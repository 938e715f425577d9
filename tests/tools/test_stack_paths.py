#!/usr/bin/python3
"""tools/stack_paths.py on small programs: the deepest path, and everything it must refuse."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from stack_paths import Graph, Refused  # noqa: E402

USE = "void use(volatile char *bytes);\n"


def graph(source: str, pointers: dict[str, list[str]] | None = None, outside: dict[str, int] | None = None) -> Graph:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "program.c").write_text(USE + source)
        subprocess.run(["gcc", "-O1", "-fno-inline", "-fno-optimize-sibling-calls", "-fno-stack-protector",
                        "-fcallgraph-info=su", "-c", "program.c", "-o", "program.o"], cwd=folder, check=True)
        return Graph(folder, [folder / "program.ci"], pointers or {}, {"use": 0} if outside is None else outside)


class StackPaths(unittest.TestCase):
    def test_the_deepest_path_counts(self):
        told = graph("static void small(void) { volatile char b[100]; use(b); }\n"
                     "static void large(void) { volatile char b[1000]; use(b); }\n"
                     "void start(void) { volatile char b[10]; small(); large(); small(); use(b); }\n").worst("start")
        self.assertEqual(told.functions, ("start", "large", "use"))
        self.assertGreater(told.bytes, 1010)
        self.assertLess(told.bytes, 1010 + 128)

    def test_frames_from_outside_count(self):
        source = "void start(void) { volatile char b[10]; use(b); }\n"
        self.assertEqual(graph(source, outside={"use": 500}).worst("start").bytes
                         - graph(source, outside={"use": 0}).worst("start").bytes, 500)
        with self.assertRaisesRegex(Refused, "use: called by start, frame unknown"):
            graph(source, outside={}).worst("start")

    def test_recursion_is_refused(self):
        told = graph("void other(int n);\nvoid start(int n) { if (n) { other(n - 1); } }\n"
                     "void other(int n) { volatile char b[1]; use(b); start(n); }\n")
        with self.assertRaisesRegex(Refused, "recursion: start > other > start"):
            told.worst("start")

    def test_calls_through_pointers_need_their_targets(self):
        source = ("struct ops { void (*act)(void); };\n"
                  "static void one(void) { volatile char b[2000]; use(b); }\n"
                  "const struct ops ops = {one};\n"
                  "void start(const struct ops *o) { o->act(); }\n")
        with self.assertRaisesRegex(Refused, "targets are not listed"):
            graph(source)
        told = graph(source, {"act": ["one", "not_in_this_program"]}).worst("start")
        self.assertEqual(told.functions, ("start", "one", "use"))
        self.assertGreater(told.bytes, 2000)

    def test_frames_of_variable_size_are_refused(self):
        with self.assertRaisesRegex(Refused, "variable size"):
            graph("void start(int n) { volatile char b[n]; use(b); }\n")

    def test_names_must_be_one_function(self):
        with self.assertRaisesRegex(Refused, "0 functions of that name"):
            graph("void start(void) { }\n").worst("nobody")


if __name__ == "__main__":
    unittest.main()
