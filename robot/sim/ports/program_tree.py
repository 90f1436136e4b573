"""Tree of a PolyScope program, the XML of a ``.urp`` file, as lines of URScript.

Nodes that are understood: sequence before start, assignment of an expression, script (line and file), if, loop, wait
for a time, move to positions in variables, thread, folder, comment, and External Control. Any other is refused by name.
Each variable is global, as PolyScope's are; each loop waits for the next cycle at its end.

Source: files that Universal Robots published with its client libraries; the format itself is not documented.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from coneskin.robot.sim.urscript.values import ScriptError

__all__ = ["EXTERNAL_CONTROL", "program_lines"]

#: line that stands for the script of an External Control node until ``play`` has asked for it
EXTERNAL_CONTROL = "# script of the node External Control"
_EXTERNAL_CONTROL_CLASS = "com.fzi.externalcontrol.ExternalControlNode"
_WITHOUT_EFFECT = ("Comment", "InitVariablesNode")
_MOVE_FUNCTIONS = {"MoveJ": "movej", "MoveL": "movel", "MoveP": "movep"}
#: sign of PolyScope's keyboard for expressions -> URScript
_EXPRESSION_SIGNS = str.maketrans({"≟": "==", "≠": "!=", "≤": "<=", "≥": ">="})
_BASE_FEATURE = "Joint_0_name"  # name of the feature that is the base


def program_lines(root: ET.Element, function: str) -> list[str]:
    """Return the URScript of a program.

    Args:
        root: the element ``URProgram``.
        function: name for the program.

    Raises:
        ScriptError: it has no main program, or a node that is not simulated.
    """
    return _Tree(root).program(function)


class _Tree:
    """Program with the way from each of its elements to the one above."""

    def __init__(self, root: ET.Element) -> None:
        self._root = root
        self._above = {child: parent for parent in root.iter() for child in parent}

    def program(self, function: str) -> list[str]:
        main = self._root.find("./children/MainProgram")
        if main is None:
            raise ScriptError("it has no main program")
        before: list[str] = []
        threads: list[str] = []
        for node in self._root.findall("./children/*"):
            if node.tag == "SpecialSequence" and node.get("type") == "BeforeStart":
                before += self._body(node)
            elif node.tag == "Thread":
                name = re.sub(r"\W", "_", node.get("name", "thread"))
                threads += [f"thread {name}():", *self._repeated(node), "end", f"{name}_handle = run {name}()"]
            elif node is not main and node.tag not in _WITHOUT_EFFECT:
                raise self._unknown(node)
        return [f"def {function}():", *before, *threads, *self._repeated(main), "end"]

    def _repeated(self, node: ET.Element) -> list[str]:
        body = self._body(node)
        return body if node.get("runOnlyOnce") == "true" else ["while True:", *body, "sync()", "end"]

    def _body(self, parent: ET.Element) -> list[str]:
        lines: list[str] = []
        for node in parent.findall("./children/*"):
            if node.tag not in _WITHOUT_EFFECT and node.get("suppressed") != "true":
                lines += self._node(node)
        return lines

    def _node(self, node: ET.Element) -> list[str]:
        match (node.tag, node.get("type") or node.get("valueSource") or ""):
            case "Folder", _:
                return self._body(node)
            case "Wait", "Sleep":
                return [f"sleep({_number(node.findtext('waitTime', ''), 'a wait')!r})"]
            case "Script", "Line":
                return [self._expression(node)]
            case "Script", "File":
                return node.findtext("cachedContents", "").splitlines()
            case "Assignment", "Expression":
                return [f"global {self._variable(node.find('variable'))} = {self._expression(node)}"]
            case "If", "If":
                return [f"if {self._expression(node)}:", *self._body(node), "end"]
            case "Loop", "While":
                return [f"while {self._expression(node)}:", *self._body(node), "sync()", "end"]
            case "Loop", "Forever":
                return ["while True:", *self._body(node), "sync()", "end"]
            case "Move", _:
                return self._move(node)
            case "Contributed", _ if node.get("strategyClass") == _EXTERNAL_CONTROL_CLASS:
                return [EXTERNAL_CONTROL]
        raise self._unknown(node)

    def _move(self, node: ET.Element) -> list[str]:
        kind, feature = _MOVE_FUNCTIONS.get(node.get("motionType", "")), node.find("feature")
        if kind is None or (feature is not None and feature.get("referencedName") != _BASE_FEATURE):
            raise self._unknown(node)
        limits = ", ".join(
            f"{key}={_number(node.get(name, ''), 'a move')!r}" for key, name in (("a", "acceleration"), ("v", "speed"))
        )
        lines = []
        for point in node.findall("./children/*"):
            if point.tag != "Waypoint" or point.get("type") != "Variable":
                raise self._unknown(point)
            lines.append(f"{kind}({self._variable(point.find('variable'))}, {limits})")
        return lines

    def _expression(self, node: ET.Element) -> str:
        text = ""
        for part in node.findall("./expression/*"):
            if part.tag == "ExpressionChar":
                text += part.get("character", "")
            elif part.tag == "ExpressionToken":
                text += part.get("token", "")
            elif part.tag == "ExpressionVariable":
                text += self._variable(part.find("ProgramVariable"))
            else:
                raise self._unknown(part)
        if "\n" in text or not text.strip():
            raise ScriptError(f"the node {node.tag} has no expression of one line")
        return text.strip().translate(_EXPRESSION_SIGNS)

    def _variable(self, element: ET.Element | None) -> str:
        """Return the name of a variable, which may be a reference to where it stands first."""
        seen = 0
        while element is not None and (way := element.get("reference")) is not None and seen < 10:
            element, seen = self._follow(element, way), seen + 1
        name = element.get("name", "") if element is not None else ""
        if not name.isidentifier():
            raise ScriptError(f"a variable needs a name, got {name!r}")
        return name

    def _follow(self, element: ET.Element | None, way: str) -> ET.Element | None:
        """Return the element at the end of a way such as ``../../Assignment[2]/variable``."""
        for step in way.split("/"):
            if element is None:
                return None
            match = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", step)
            if step == "..":
                element = self._above.get(element)
            elif match is None:
                return None
            else:
                same, number = element.findall(match[1]), int(match[2] or 1)
                element = same[number - 1] if 1 <= number <= len(same) else None
        return element

    def _unknown(self, node: ET.Element) -> ScriptError:
        kind = node.get("type") or node.get("motionType") or ""
        what = node.get("strategyProgramNodeType") or " ".join(filter(None, (node.tag, kind)))
        return ScriptError(f"the node {what} is not simulated; save its .script file beside the program")


def _number(text: str, whose: str) -> float:
    try:
        return float(text)
    except ValueError as exc:
        raise ScriptError(f"{whose} needs its numbers: {exc}") from exc
