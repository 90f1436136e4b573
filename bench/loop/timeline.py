"""Timeline of a start: what each process imports, makes and waits for, from stamps that a process takes of itself.

``environment`` returns what makes every Python process below it take them, by a ``sitecustomize`` of its own. Nothing
of the product knows of that: outermost imports are stamped by the machinery of imports, calls by wrapped functions.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

FILE_VARIABLE = "CONESKIN_BENCH_TIMELINE"
IMPORT, INTERPRETER = "m", "i"
#: letter in the picture -> what it is, and the functions that are stamped with it
CALLS = {
    "c": ("starts the children", ("coneskin.session.child_processes:ChildProcesses.start",)),
    "a": ("waits until the guard is active", ("coneskin.session.session:Session._await_activation",)),
    "s": ("reads the scene", ("coneskin.scene.reader:parse_scene",)),
    "b": ("makes the core", ("coneskin.scene.build:place_on_arm", "coneskin.scene.build:build_core")),
    "f": ("loads the field of the virtual skin", ("coneskin.session.skin_process:virtual_skin",)),
    "w": ("waits for the skin's reader", ("coneskin.skin.virtual.pseudo_terminal:wait_for_reader",)),
    "p": ("plays", ("coneskin.skin.virtual.pseudo_terminal:play",)),
    "o": ("opens the port", ("coneskin.skin.sources.kinds:open_source",)),
    "r": ("connects ur_rtde", ("coneskin.robot.ur.ur_rtde:UrArm.__enter__",)),
    "q": ("asks which arm it is", ("coneskin.robot.ur.model_check:check_model",)),
    "g": ("guards", ("coneskin.robot.guard.loop:GuardLoop.run",)),
    "d": ("serves", ("coneskin.robot.ur.driver_process:_DriverProcess.run",)),
}


class Span(NamedTuple):
    """What one process did from one time to another [s]; one that has not ended yet ends at infinity."""

    process: str
    letter: str
    begin: float
    end: float


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of processes that stamp into a folder."""
    (folder / "sitecustomize.py").write_text("import bench.loop.timeline\n\nbench.loop.timeline.install()\n")
    root = str(Path(__file__).parents[2])
    paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", ""), root])
    return {**os.environ, "PYTHONPATH": paths, FILE_VARIABLE: str(folder / "stamps")}


def spans(folder: Path) -> list[Span]:
    """Return what the processes have stamped into a folder."""
    begun: dict[tuple[str, str, str], float] = {}
    found = []
    for line in (folder / "stamps").read_text().splitlines():
        process, letter, number, which, at = line.split("\t")
        if which == "begin":
            begun[process, letter, number] = float(at)
        else:
            found.append(Span(process, letter, begun.pop((process, letter, number)), float(at)))
    return found + [Span(process, letter, at, float("inf")) for (process, letter, _), at in begun.items()]


def picture(found: list[Span], process: str, begin: float, end: float, step: float) -> str:
    """Return a line with a letter for each step [s] between two times: what the process did at its end."""
    line = ""
    mine = sorted((span for span in found if span.process == process), key=lambda span: span.begin)
    for number in range(int((end - begin) / step) + 1):
        at = begin + (number + 1) * step
        line += next((span.letter for span in reversed(mine) if span.begin <= at < span.end), " ")
    return line.rstrip()


def install() -> None:
    """Stamp what this process does from now on."""
    if FILE_VARIABLE not in os.environ:
        return
    modules = [word for word in sys.orig_argv if word.startswith("coneskin.")]
    stamps = _Stamps(os.environ[FILE_VARIABLE], modules[0].split(".")[-1] if modules else "program")
    stamps.mark(INTERPRETER, 0, "begin", time.monotonic() - time.process_time())
    stamps.mark(INTERPRETER, 0, "end", time.monotonic())
    sys.meta_path.insert(0, _Finder(stamps))


class _Stamps:
    def __init__(self, path: str, process: str) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        self._process, self._number = process, 0
        self.depth = 0  # of imports

    def mark(self, letter: str, number: int, which: str, at: float) -> None:
        os.write(self._file, f"{self._process}\t{letter}\t{number}\t{which}\t{at:.6f}\n".encode())

    def around(self, letter: str, call: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(call)
        def stamped(*arguments: Any, **named: Any) -> Any:
            self._number += 1
            number = self._number
            self.mark(letter, number, "begin", time.monotonic())
            try:
                return call(*arguments, **named)
            finally:
                self.mark(letter, number, "end", time.monotonic())

        return stamped


class _Loader(importlib.abc.Loader):
    def __init__(self, inner: Any, name: str, stamps: _Stamps) -> None:
        self._inner, self._name, self._stamps = inner, name, stamps

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        return self._inner.create_module(spec)  # type: ignore[no-any-return]

    def exec_module(self, module: ModuleType) -> None:
        stamps = self._stamps
        execute = self._inner.exec_module if stamps.depth else stamps.around(IMPORT, self._inner.exec_module)
        stamps.depth += 1
        try:
            execute(module)
        finally:
            stamps.depth -= 1
        for letter, (_, functions) in CALLS.items():
            for function in functions:
                name, _, path = function.partition(":")
                if name == self._name:
                    *owners, last = path.split(".")
                    owner = functools.reduce(getattr, owners, module)
                    setattr(owner, last, stamps.around(letter, getattr(owner, last)))


class _Finder(importlib.abc.MetaPathFinder):
    def __init__(self, stamps: _Stamps) -> None:
        self._stamps = stamps

    def find_spec(
        self, name: str, path: Any = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if not name.startswith("coneskin"):
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader, name, self._stamps)
        return spec


def legend(found: list[Span]) -> Mapping[str, str]:
    """Return what the letters mean that occur."""
    words = {INTERPRETER: "the interpreter starts", IMPORT: "imports"} | {key: word for key, (word, _) in CALLS.items()}
    return {letter: word for letter, word in words.items() if any(span.letter == letter for span in found)}
