"""The worst stack of a C program, from what GCC writes with -fcallgraph-info=su: frame sizes and calls per file.

A path is as deep as the frames on it. What cannot be bounded is refused, not guessed: recursion, frames of variable
size, calls through a pointer whose targets are not listed, functions from outside whose frame is not listed.
"""

from __future__ import annotations

import dataclasses
import pathlib
import re

NODE = re.compile(r'node: \{ title: "([^"]+)" label: "([^"]*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"(?: label: "([^"]*)")?')
FRAME = re.compile(r"(\d+) bytes \(([^)]*)\)")
POINTER = "__indirect_call"
CALLED = re.compile(r"([A-Za-z_]\w*)\s*\(")


class Refused(Exception):
    """The stack has no bound that this tool could state."""


@dataclasses.dataclass(frozen=True)
class Path:
    bytes: int
    functions: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.bytes} bytes: " + " > ".join(self.functions)


def short(title: str) -> str:
    """`core/kl_step.c:damp.isra.0` as `damp`."""
    return title.rpartition(":")[2].partition(".")[0]


class Graph:
    """`pointers`: for a call through a pointer, by the member's name in the source, the functions it may reach;
    those that are not part of this program are left out. `outside`: frames of functions without source."""

    def __init__(self, root: pathlib.Path, files: list[pathlib.Path], pointers: dict[str, list[str]],
                 outside: dict[str, int]):
        self.frames: dict[str, int] = {}
        self.calls: dict[str, set[str]] = {}
        self._root = root
        self._pointers = pointers
        self._outside = outside
        self._through: list[tuple[str, str]] = []
        self._known: dict[str, Path] = {}
        for file in files:
            self._read(file)
        self._by_name: dict[str, list[str]] = {}
        for title in self.frames:
            self._by_name.setdefault(short(title), []).append(title)
        for caller, place in self._through:
            self.calls[caller] |= set(self._targets(caller, place))

    def _read(self, file: pathlib.Path) -> None:
        for line in file.read_text().splitlines():
            if node := NODE.match(line):
                if frame := FRAME.search(node[2]):
                    if "static" not in frame[2] and "bounded" not in frame[2]:
                        raise Refused(f"{node[1]}: a frame of variable size")
                    self.frames[node[1]] = int(frame[1])
                    self.calls.setdefault(node[1], set())
            elif edge := EDGE.match(line):
                self.calls.setdefault(edge[1], set())
                if edge[2] == POINTER:
                    self._through.append((edge[1], edge[3] or ""))
                else:
                    self.calls[edge[1]].add(edge[2])

    def _targets(self, caller: str, place: str) -> list[str]:
        file, line, column = place.rsplit(":", 2)
        text = (self._root / file).read_text().splitlines()[int(line) - 1]
        names = CALLED.findall(text[max(int(column) - 1, 0):]) + CALLED.findall(text)
        member = next((name for name in names if name in self._pointers), None)
        if member is None:
            raise Refused(f"{caller}: a call through a pointer whose targets are not listed: {text.strip()}")
        return [title for name in self._pointers[member] for title in self._by_name.get(name, [])]

    def find(self, name: str) -> str:
        titles = self._by_name.get(name, [])
        if len(titles) != 1:
            raise Refused(f"{name}: {len(titles)} functions of that name")
        return titles[0]

    def reached(self, names: list[str]) -> set[str]:
        """Every function with source that these may call, themselves included."""
        found: set[str] = set()
        waiting = [self.find(name) for name in names]
        while waiting:
            title = waiting.pop()
            if title not in found and title in self.frames:
                found.add(title)
                waiting += self.calls[title]
        return found

    def worst(self, name: str) -> Path:
        return self._worst(self.find(name), ())

    def _worst(self, title: str, above: tuple[str, ...]) -> Path:
        if title in above:
            raise Refused("recursion: " + " > ".join((*above[above.index(title):], title)))
        if title not in self._known:
            if title not in self.frames:
                if short(title) not in self._outside:
                    raise Refused(f"{title}: called by {above[-1] if above else 'nobody'}, frame unknown")
                self._known[title] = Path(self._outside[short(title)], (short(title),))
            else:
                deepest = max((self._worst(callee, (*above, title)) for callee in sorted(self.calls[title])),
                              key=lambda path: path.bytes, default=Path(0, ()))
                self._known[title] = Path(self.frames[title] + deepest.bytes, (short(title), *deepest.functions))
        return self._known[title]
