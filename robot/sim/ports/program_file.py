"""Programs that the dashboard can load: the folder that stands for the disk, and program files as URScript.

PolyScope writes the URScript of a program beside its ``.urp`` file, in a ``.script`` file of the same name, and that is
what runs. A line in it may stand for the script of an External Control node.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from coneskin.core.files import read_file
from coneskin.robot.sim.urscript.translator import MAX_LENGTH
from coneskin.robot.sim.urscript.values import ScriptError

#: line that stands for the script of an External Control node until ``play`` has asked for it
EXTERNAL_CONTROL = "# script of the node External Control"


@dataclass(frozen=True, slots=True)
class ProgramFile:
    """Program that is loaded."""

    name: str  #: of its file, with the extension
    path: str  #: of its file, as PolyScope gives it
    text: str  #: its URScript, from ``def`` to ``end``

    @property
    def takes_external_script(self) -> bool:
        """True where a node of it takes its script from another program."""
        return EXTERNAL_CONTROL in self.text

    @property
    def function(self) -> str:
        """Name of the program in its text; empty where it has none."""
        match = re.search(r"^[ \t]*def[ \t]+(\w+)", self.text, re.MULTILINE)
        return match[1] if match else ""


def _program_text(name: str, data: bytes) -> str:
    """Return the URScript of a ``.script`` file: as it is, or as the body of a program of the file's name."""
    text = data.decode("utf-8", "replace")
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    function = re.sub(r"\W", "_", name.rpartition(".")[0]) or "program"
    return text if first.startswith("def ") else f"def {function}():\n{text}\nend\n"


#: where PolyScope has its programs, on a robot and in Universal Robots' own simulator
_PROGRAM_ROOTS = ("/ursim/programs/", "/programs/")
_MAX_PROGRAM_SIZE = 4 * MAX_LENGTH  # bytes of a file


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
        for start in _PROGRAM_ROOTS:
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

    def load(self, name: str) -> ProgramFile:
        """Return a program.

        Raises:
            FileNotFoundError: there is no such file.
            OSError: it cannot be read, or is too long.
            ScriptError: it has no ``.script`` file beside it.
        """
        path = self.locate(name)
        if not path.is_file():
            raise FileNotFoundError(name)
        source = path.with_suffix(".script") if path.suffix == ".urp" else path
        if not source.is_file():
            raise ScriptError(
                f"{name} has no {source.name} beside it, which PolyScope writes with it. For one of the "
                f"node External Control alone, write that file, with the line {EXTERNAL_CONTROL!r}"
            )
        assert self.root is not None
        shown = f"{_PROGRAM_ROOTS[1]}{path.relative_to(self.root).as_posix()}"
        return ProgramFile(path.name, shown, _program_text(path.name, read_file(source, _MAX_PROGRAM_SIZE)))

    def has(self, name: str) -> bool:
        """Return whether there is such a file."""
        try:
            return self.locate(name).is_file()
        except FileNotFoundError:
            return False

    def save(self, name: str, data: bytes) -> Path:
        """Write a file into the folder, and return its path.

        Raises:
            OSError: it cannot be written, would be outside, or there is no folder.
        """
        path = self.locate(name)
        path.write_bytes(data)
        return path
