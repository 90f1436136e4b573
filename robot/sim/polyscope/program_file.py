"""Program files of PolyScope as URScript: what ``play`` runs after ``load``.

A ``.urp`` file is XML, packed with gzip or not, in which each node of the program tree is an element; see
`program_tree`. PolyScope writes the URScript of a program beside it, in a ``.script`` file of the same name: where that
exists it is run instead, whatever the nodes. A ``.urpx`` file of PolyScope X is JSON that has the URScript in it.
"""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
import zlib
from dataclasses import dataclass

from coneskin.robot.sim.urscript.translator import MAX_LENGTH
from coneskin.robot.sim.urscript.values import ScriptError

from .program_tree import EXTERNAL_CONTROL, program_lines

__all__ = ["ProgramFile", "program_information", "read_program"]

_GZIP = 31  # window bits for zlib: the largest, in gzip's format


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


def read_program(name: str, data: bytes) -> str:
    """Return the URScript of a program file.

    Args:
        name: of the file, with ``.urp``, ``.urpx`` or ``.script``.
        data: its content.

    Raises:
        ScriptError: it is none of them, or has a node that is not simulated.
    """
    function = re.sub(r"\W", "_", name.rpartition(".")[0]) or "program"
    if name.endswith(".urpx"):
        return f"def {function}():\n{_script_of(name, data)}\nend\n"
    if not name.endswith(".urp"):
        text = data.decode("utf-8", "replace")
        lines = (line.strip() for line in text.splitlines())
        first = next((line for line in lines if line and not line.startswith("#")), "")
        return text if first.startswith("def ") else f"def {function}():\n{text}\nend\n"
    if data[:2] == b"\x1f\x8b":
        try:
            data = zlib.decompressobj(_GZIP).decompress(data, MAX_LENGTH)
        except zlib.error as exc:
            raise ScriptError(f"{name} is not a program: {exc}") from exc
    if b"<!DOCTYPE" in data:
        raise ScriptError(f"{name} is not a program: it declares a document type")
    try:
        root = ET.fromstring(data)
    except ET.ParseError as exc:
        raise ScriptError(f"{name} is not a program: {exc}") from exc
    try:
        return "\n".join([*program_lines(root, function), ""])
    except (ScriptError, RecursionError) as exc:
        raise ScriptError(f"{name}: {exc}") from exc


def program_information(data: bytes) -> dict[str, object]:
    """Return what a ``.urpx`` file says of its program: name, description, dates.

    Raises:
        ValueError: it is not such a file.
    """
    try:
        found = json.loads(data)["program"]["programInformation"]
        if isinstance(found["name"], str) and found["name"]:
            return dict(found)
    except (KeyError, TypeError, RecursionError) as exc:
        raise ValueError(f"no program of PolyScope X: {exc}") from exc
    raise ValueError("no program of PolyScope X: it has no name")


def _script_of(name: str, data: bytes) -> str:
    try:
        return str(json.loads(data)["program"]["urscript"]["script"])
    except (ValueError, KeyError, TypeError, RecursionError) as exc:
        raise ScriptError(f"{name} is not a program of PolyScope X: {type(exc).__name__} {exc}") from exc
