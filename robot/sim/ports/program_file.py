"""Programs that the dashboard can load: the folder that stands for the disk, and program files as URScript.

A ``.urp`` file is XML, packed with gzip or not. PolyScope writes the URScript of a program beside it, in a ``.script``
file of the same name, and that is what runs. Without one, only a program whose single node is External Control is
loaded.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
import zlib
from dataclasses import dataclass
from pathlib import Path

from coneskin.core.files import read_file
from coneskin.robot.sim.urscript.translator import MAX_LENGTH
from coneskin.robot.sim.urscript.values import ScriptError

#: line that stands for the script of an External Control node until ``play`` has asked for it
EXTERNAL_CONTROL = "# script of the node External Control"
_EXTERNAL_CONTROL_CLASS = "com.fzi.externalcontrol.ExternalControlNode"
_WITHOUT_EFFECT = ("Comment", "Folder", "InitVariablesNode")
_GZIP_WINDOW = 31  # window bits for zlib: the largest, in gzip's format


@dataclass(frozen=True, slots=True)
class ProgramFile:
    """Program that is loaded.

    Attributes:
        name: of its file, with the extension.
        path: of its file, as PolyScope gives it.
        text: its URScript, from ``def`` to ``end``.
    """

    name: str
    path: str
    text: str

    @property
    def takes_external_script(self) -> bool:
        """True where a node of it takes its script from another program."""
        return EXTERNAL_CONTROL in self.text

    @property
    def function(self) -> str:
        """Name of the program in its text; empty where it has none."""
        match = re.search(r"^[ \t]*def[ \t]+(\w+)", self.text, re.MULTILINE)
        return match[1] if match else ""


def _read_program(name: str, data: bytes) -> str:
    """Return the URScript of a program file.

    Args:
        name: of the file, with ``.urp`` or ``.script``.
        data: its content.

    Raises:
        ScriptError: it is none of them, or a ``.urp`` of other nodes than External Control.
    """
    function = re.sub(r"\W", "_", name.rpartition(".")[0]) or "program"
    if not name.endswith(".urp"):
        text = data.decode("utf-8", "replace")
        lines = (line.strip() for line in text.splitlines())
        first = next((line for line in lines if line and not line.startswith("#")), "")
        return text if first.startswith("def ") else f"def {function}():\n{text}\nend\n"
    try:
        if data[:2] == b"\x1f\x8b":
            data = zlib.decompressobj(_GZIP_WINDOW).decompress(data, MAX_LENGTH)
        if b"<!DOCTYPE" in data:
            raise ScriptError(f"{name} is not a program: it declares a document type")
        root = ET.fromstring(data)
    except (zlib.error, ET.ParseError) as exc:
        raise ScriptError(f"{name} is not a program: {exc}") from exc
    main = root.find("./children/MainProgram")
    if main is None:
        raise ScriptError(f"{name} has no main program")
    nodes = [node for node in root.iterfind(".//children/*") if node is not main and node.tag not in _WITHOUT_EFFECT]
    if [node.get("strategyClass") for node in nodes] != [_EXTERNAL_CONTROL_CLASS]:
        kinds = dict.fromkeys(node.get("strategyProgramNodeType") or node.tag for node in nodes)
        raise ScriptError(
            f"{name} has the nodes {', '.join(kinds) or 'of an empty program'}, and only a single External Control is "
            "simulated; save its .script file beside the program"
        )
    once = main.get("runOnlyOnce") == "true"
    body = [EXTERNAL_CONTROL] if once else ["while True:", EXTERNAL_CONTROL, "sync()", "end"]
    return "\n".join([f"def {function}():", *body, "end", ""])


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
            ScriptError: it is not a program, or not one that is simulated.
        """
        path = source = self.locate(name)
        if not path.is_file():
            raise FileNotFoundError(name)
        if path.suffix == ".urp" and (beside := path.with_suffix(".script")).is_file():
            source = beside
        assert self.root is not None
        shown = f"{_PROGRAM_ROOTS[1]}{path.relative_to(self.root).as_posix()}"
        return ProgramFile(path.name, shown, _read_program(source.name, read_file(source, _MAX_PROGRAM_SIZE)))

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
