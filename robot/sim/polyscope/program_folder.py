"""Folder that stands for the disk of the simulated controller: programs, installations, and what it saves."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from coneskin.core.files import read_file
from coneskin.robot.sim.urscript.translator import MAX_LENGTH

from .program_file import ProgramFile, read_program

__all__ = ["ProgramFolder"]

#: where PolyScope has its programs, on a robot and in Universal Robots' own simulator
_ROOTS = ("/ursim/programs/", "/programs/")
_LARGEST_PROGRAM = 4 * MAX_LENGTH  # bytes of a file


class ProgramFolder:
    """Folder with the programs that the dashboard can load; sub-folders count, and nothing outside it does.

    Args:
        root: the folder; without one no file is found, and nothing can be saved.
    """

    def __init__(self, root: Path | None) -> None:
        self.root = root.resolve() if root is not None else None

    def locate(self, name: str) -> Path:
        """Return the path of a file in the folder.

        Args:
            name: relative to the folder, or from ``/programs/`` or ``/ursim/programs/``.

        Raises:
            FileNotFoundError: it would be outside, or there is no folder.
        """
        for start in _ROOTS:
            name = name.removeprefix(start)
        if self.root is None or not name or "\0" in name:
            raise FileNotFoundError(name)
        try:
            path = (self.root / name).resolve()
        except (RuntimeError, ValueError) as exc:  # links in a circle, a name that no file can have
            raise FileNotFoundError(name) from exc
        if not path.is_relative_to(self.root):
            raise FileNotFoundError(name)
        return path

    def read(self, name: str) -> bytes:
        """Return the content of a file.

        Raises:
            FileNotFoundError: there is no such file.
            OSError: it cannot be read, or is too long.
        """
        path = self.locate(name)
        if not path.is_file():
            raise FileNotFoundError(name)
        return read_file(path, _LARGEST_PROGRAM)

    def load(self, name: str) -> ProgramFile:
        """Return a program.

        Raises:
            FileNotFoundError: there is no such file.
            OSError: it cannot be read.
            ScriptError: it is not a program, or not one that is simulated.
        """
        path, source = self.locate(name), name
        data = self.read(name)
        beside = path.with_suffix(".script")
        if path.suffix == ".urp" and beside.is_file():
            data, source = read_file(beside, _LARGEST_PROGRAM), beside.name
        assert self.root is not None
        shown = f"{_ROOTS[1]}{path.relative_to(self.root).as_posix()}"
        return ProgramFile(path.name, shown, read_program(Path(source).name, data))

    def has(self, name: str) -> bool:
        """Return whether there is such a file."""
        try:
            return self.locate(name).is_file()
        except FileNotFoundError:
            return False

    def names(self, *suffixes: str) -> Iterable[str]:
        """Return the paths, relative to the folder, of all files that end in one of these ways."""
        found = sorted(self.root.rglob("*")) if self.root is not None else []
        return [path.relative_to(self.root).as_posix() for path in found if path.suffix in suffixes]  # type: ignore[arg-type]

    def save(self, name: str, data: bytes) -> Path:
        """Write a file into the folder, and return its path.

        Raises:
            OSError: it cannot be written, would be outside, or there is no folder.
        """
        path = self.locate(name)
        path.write_bytes(data)
        return path
