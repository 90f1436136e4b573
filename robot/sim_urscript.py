"""URScript to Python: what lets the simulated controller run the very program that ur_rtde uploads.

A program becomes a Python module whose blocking functions are generators: each ``yield`` ends the thread's turn in the
2 ms control cycle. So the quirks of a program are those of its own text, and nothing here knows about ur_rtde.

Understood: def, sec, thread, if/elif/else, while, break, continue, return, halt, global, local, assignment (also to an
element), run, kill, join, enter_critical, exit_critical, lists, poses, named arguments, the arithmetic and logic.
Not understood: struct, for, switch, interpreter mode. A name assigned in a function is local to it, unless the program
declares it global anywhere; variables of the program's own body can be read everywhere.

Source: Universal Robots, "The URScript Programming Language", chapters 1-2 (language) and 3 (threads).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Set
from dataclasses import dataclass
from types import CodeType

from .sim_syntax import Function, Parser
from .sim_values import ScriptError

__all__ = ["Translation", "complete_programs", "translate"]

_OPENS = re.compile(r"(?:def|sec|thread|if|while)\b")


@dataclass(frozen=True, slots=True)
class Translation:
    """A program ready to run.

    Attributes:
        name: what the text calls it.
        secondary: it is a ``sec`` program, which runs beside the main one and cannot move the arm.
        code: a Python module that defines ``main``, a generator function, and the threads and functions it uses.
    """

    name: str
    secondary: bool
    code: CodeType


def complete_programs(text: str) -> tuple[list[str], str]:
    """Cut what has arrived on a script port into whole programs.

    Returns:
        the programs (from ``def`` or ``sec`` to its ``end``, or one line by itself), and what is not complete yet.
    """
    programs, start, position, depth = [], 0, 0, 0
    while (stop := text.find("\n", position)) >= 0:
        line = text[position:stop].strip()
        position = stop + 1
        if _OPENS.match(line):
            depth += 1
        elif line == "end" or line.startswith(("end ", "end#", "end\t")):
            depth = max(0, depth - 1)
        if depth == 0:
            if (block := text[start:position]).strip() and not line.startswith("#"):
                programs.append(block)
            start = position
    return programs, text[start:]


def translate(
    text: str, builtins: Set[str], blocking: Set[str], replace: Mapping[str, str] | None = None
) -> Translation:
    """Turn one program into a Python module.

    Args:
        text: from ``def name():`` or ``sec name():`` to ``end``, or a single line.
        builtins: names of the functions that the controller offers.
        blocking: those of them that take time, and so are generators.
        replace: function name -> URScript text to use for its definition instead.

    Raises:
        ScriptError: the text is not URScript as described above; the message gives the line.
    """
    lines = _numbered_lines(text)
    if not lines or not re.match(r"(def|sec)\b", lines[0][1]):
        lines = [(0, "def unnamed():"), *lines, (0, "end")]
    parser = Parser(lines)
    program = parser.program()
    for name, definition in (replace or {}).items():
        if name in parser.functions:
            other = Parser(_numbered_lines(definition))
            other.program()
            parser.functions |= other.functions
            parser.globals |= other.globals
    source = _Writer(program, parser, builtins, blocking).module()
    return Translation(program.name, program.kind == "sec", compile(source, f"<{program.name}>", "exec"))


def _numbered_lines(text: str) -> list[tuple[int, str]]:
    """Numbered lines without comments and blanks; an unfinished one takes what it lacks from the next.

    ur_rtde writes the value of ``global offset =`` at the start of the next line, before that line's own statement.
    """
    lines: list[tuple[int, str]] = []
    for number, raw in enumerate(text.splitlines(), 1):
        line = (raw if "#" not in raw else _without_comment(raw)).strip()
        if not line:
            continue
        if lines and lines[-1][1].endswith("=") and (value := re.match(r"[-+]?[\d.eE]+", line)):
            lines[-1] = (lines[-1][0], f"{lines[-1][1]} {value[0]}")
            line = line[value.end() :].strip()
            if not line:
                continue
        elif lines and lines[-1][1].endswith((",", "(", "[")):
            lines[-1] = (lines[-1][0], f"{lines[-1][1]} {line}")
            continue
        lines.append((number, line))
    return lines


def _without_comment(line: str) -> str:
    quote = ""
    for position, letter in enumerate(line):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter == "#":
            return line[:position]
    return line


class _Writer:
    """Python source from the tree."""

    def __init__(self, program: Function, parser: Parser, builtins: Set[str], blocking: Set[str]) -> None:
        self.program = program
        self.functions = parser.functions
        self.globals = parser.globals
        for made in self.functions.values():
            unknown = made.calls - builtins - set(self.functions)
            if unknown:
                raise ScriptError(f"{made.name}: the controller has no function {', '.join(sorted(unknown))}")
        self.blocking = set(blocking)
        self._spread_blocking()

    def _spread_blocking(self) -> None:
        """A function that calls one that blocks, or that joins a thread, blocks too."""
        for made in self.functions.values():
            if _contains(made.body, "join"):
                self.blocking.add(made.name)
        grew = True
        while grew:
            grew = False
            for made in self.functions.values():
                if made.name not in self.blocking and made.calls & self.blocking:
                    self.blocking.add(made.name)
                    grew = True

    def module(self) -> str:
        lines: list[str] = []
        shared = self.globals | self.program.assigned
        for made in self.functions.values():
            is_main = made is self.program
            parameters = ", ".join(f"v_{name}=0" for name in made.parameters)
            lines.append(f"def {'main' if is_main else 'f_' + made.name}({parameters}):")
            held = (made.assigned | made.elements) & (shared if is_main else self.globals) - set(made.parameters)
            if held:
                lines.append("    global " + ", ".join(f"v_{name}" for name in sorted(held)))
            lines += [f"    v_{n} = _copy(v_{n})" for n in made.parameters if n in made.elements]
            self.statements(made.body, lines, "    ")
            if is_main or made.kind == "thread" or made.name in self.blocking:
                lines.append("    if False: yield")
            lines.append("    return None")
        return "\n".join(lines)

    def statements(self, body: list[tuple[object, ...]], lines: list[str], indent: str) -> None:
        for statement in body:
            kind, parts = statement[0], statement[2:]
            if kind == "if":
                branches, otherwise = parts
                word = "if"
                for test, inner in branches:  # type: ignore[attr-defined]
                    lines.append(f"{indent}{word} {self.text(test)}:")
                    self.statements(inner, lines, indent + "    ")
                    lines.append(f"{indent}    pass")
                    word = "elif"
                if otherwise:
                    lines.append(f"{indent}else:")
                    self.statements(otherwise, lines, indent + "    ")  # type: ignore[arg-type]
            elif kind == "while":
                test, inner = parts
                lines.append(f"{indent}while {self.text(test)}:")
                lines.append(f"{indent}    _turn()")
                self.statements(inner, lines, indent + "    ")  # type: ignore[arg-type]
            elif kind == "set":
                name, value = parts
                made = self.text(value)
                lines.append(f"{indent}v_{name} = " + (f"_copy({made})" if made.startswith("v_") else made))
            elif kind == "element":
                name, key, value = parts
                lines.append(f"{indent}v_{name}[{self.text(key)}] = {self.text(value)}")
            elif kind == "call":
                lines.append(f"{indent}{self.text(parts[0])}")
            elif kind == "return":
                lines.append(f"{indent}return {self.text(parts[0])}")
            elif kind == "kill":
                lines.append(f"{indent}_kill({self.text(parts[0])})")
            elif kind == "join":
                lines.append(f"{indent}yield from _join({self.text(parts[0])})")
            elif kind in ("enter_critical", "exit_critical", "halt"):
                lines.append(f"{indent}_{kind}()")
            else:
                lines.append(f"{indent}{kind}")

    def text(self, made: object) -> str:
        """Fill in the calls: a generator is run by ``yield from``, a function of the program has its own name."""
        out: list[str] = []
        inside: list[str] = []
        for piece in re.split(r"(\x00\w+\(|\x01|\x02\w+=)", str(made)):
            if piece.startswith("\0"):
                name = piece[1:-1]
                inside.append(name)
                prefix = "(yield from " if name in self.blocking else "("
                out.append(f"{prefix}{'f_' if name in self.functions else 'b_'}{name}(")
            elif piece.startswith("\2"):  # a named argument
                out.append(("v_" if inside and inside[-1] in self.functions else "") + piece[1:])
            elif piece == "\1":
                inside.pop()
                out.append(")")
            else:
                out.append(piece)
        return "".join(out)


def _contains(body: object, kind: str) -> bool:
    if isinstance(body, tuple) and body and body[0] == kind:
        return True
    return isinstance(body, list | tuple) and any(_contains(part, kind) for part in body)
