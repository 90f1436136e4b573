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
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from types import CodeType

from .sim_values import ScriptError

__all__ = ["Translation", "complete_programs", "translate"]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<string>\"[^\"]*\"|'[^']*')|(?P<pose>p(?=\[))"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<op>==|!=|<=|>=|[-+*/%^<>=()\[\],:.]))"
)
_OPENS = re.compile(r"(?:def|sec|thread|if|while)\b")
_BINARY = ({"or": "or", "xor": "^"}, {"and": "and"})
_COMPARE = {"==", "!=", "<", ">", "<=", ">="}
_KEYWORDS = {"and", "or", "xor", "not", "run", "True", "False"}


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
    lines = _lines(text)
    if not lines or not re.match(r"(def|sec)\b", lines[0][1]):
        lines = [(0, "def unnamed():"), *lines, (0, "end")]
    parser = _Parser(lines)
    program = parser.function()
    if parser.peek() is not None:
        number, line = parser.lines[parser.at]
        raise ScriptError(f"line {number}: {line!r} stands after the end of the program")
    for name, definition in (replace or {}).items():
        if name in parser.functions:
            other = _Parser(_lines(definition))
            other.function()
            parser.functions |= other.functions
            parser.globals |= other.globals
    source = _Writer(program, parser, builtins, blocking).module()
    return Translation(program.name, program.kind == "sec", compile(source, f"<{program.name}>", "exec"))


def _lines(text: str) -> list[tuple[int, str]]:
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


@dataclass(slots=True)
class _Function:
    """One def, sec or thread: a tree of statements (kind, line number, parts...)."""

    kind: str
    name: str
    parameters: list[str]
    body: list[tuple[object, ...]] = field(default_factory=list)
    assigned: set[str] = field(default_factory=set)
    elements: set[str] = field(default_factory=set)  # names whose elements are assigned
    calls: set[str] = field(default_factory=set)


class _Parser:
    """Statements by line, expressions by precedence climbing; expressions come out as Python text."""

    def __init__(self, lines: list[tuple[int, str]]) -> None:
        self.lines = lines
        self.at = 0
        self.functions: dict[str, _Function] = {}
        self.globals: set[str] = set()
        self.inside: list[_Function] = []
        self.tokens: list[tuple[str, str]] = []
        self.token = 0

    def peek(self) -> str | None:
        return self.lines[self.at][1] if self.at < len(self.lines) else None

    def fail(self, problem: str) -> ScriptError:
        number, line = self.lines[min(self.at, len(self.lines) - 1)]
        return ScriptError(f"line {number}: {problem} in {line!r}")

    # statements

    def function(self) -> _Function:
        match = re.fullmatch(r"(def|sec|thread)\s+(\w+)\s*\(([^)]*)\)\s*:", self.lines[self.at][1])
        if match is None:
            raise self.fail("expected 'def name():'")
        names = [part.split("=")[0].strip() for part in match[3].split(",") if part.strip()]
        made = _Function(match[1], match[2], names)
        self.functions[made.name] = made
        self.inside.append(made)
        self.at += 1
        made.body = self.block(("end",))
        self.at += 1
        self.inside.pop()
        return made

    def block(self, ends: tuple[str, ...]) -> list[tuple[object, ...]]:
        body: list[tuple[object, ...]] = []
        while (line := self.peek()) is not None:
            word = re.match(r"\w*", line)
            if word is not None and word[0] in ends:
                return body
            body += self.statement(line, word[0] if word else "")
        raise self.fail("a block has no 'end'")

    def statement(self, line: str, word: str) -> Iterator[tuple[object, ...]]:
        number = self.lines[self.at][0]
        if word in ("def", "thread"):
            self.function()
            return
        if word == "if":
            branches = [(self.condition(line[2:]), self.block(("elif", "else", "end")))]
            otherwise: list[tuple[object, ...]] = []
            while (line := self.peek() or "").startswith("elif"):
                branches.append((self.condition(line[4:]), self.block(("elif", "else", "end"))))
            if line.startswith("else"):
                self.at += 1
                otherwise = self.block(("end",))
            self.at += 1
            yield "if", number, branches, otherwise
            return
        if word == "while":
            test = self.condition(line[5:])
            body = self.block(("end",))
            self.at += 1
            yield "while", number, test, body
            return
        yield self.simple(line, word, number)
        self.at += 1

    def condition(self, text: str) -> str:
        text = text.strip()
        if not text.endswith(":"):
            raise self.fail("expected ':' at the end")
        test = self.expression(text[:-1])
        self.at += 1
        return test

    def simple(self, line: str, word: str, number: int) -> tuple[object, ...]:
        rest = line[len(word) :].strip()
        if word in ("break", "continue", "halt", "pass", "enter_critical", "exit_critical"):
            return word, number
        if word == "return":
            return word, number, self.expression(rest) if rest else "None"
        if word in ("kill", "join"):
            return word, number, self.expression(rest)
        here = self.inside[-1]
        match = re.match(r"(?:(global|local)\s+)?([A-Za-z_]\w*)\s*((?:\[[^=\]]*\])?)\s*=(?!=)(.*)$", line)
        if match is None:
            return "call", number, self.expression(line)
        scope, name, index, value = match.groups()
        if scope == "global":
            self.globals.add(name)
        if index:
            here.elements.add(name)
            key = self.expression(index[1:-1])
            return "element", number, name, key, self.expression(value)
        if scope != "local" or name not in self.globals:
            here.assigned.add(name)
        return "set", number, name, self.expression(value)

    # expressions

    def expression(self, text: str) -> str:
        self.tokens, self.token, position = [], 0, 0
        text = text.rstrip()
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                raise self.fail(f"{text[position:]!r} is not URScript")
            self.tokens.append((match.lastgroup or "", match[match.lastgroup or 0]))
            position = match.end()
        made = self.binary(0)
        if self.token < len(self.tokens):
            raise self.fail(f"{self.tokens[self.token][1]!r} is unexpected")
        return made

    def next_is(self, *values: str) -> bool:
        return self.token < len(self.tokens) and self.tokens[self.token][1] in values

    def take(self, value: str = "") -> tuple[str, str]:
        if self.token >= len(self.tokens):
            raise self.fail("the line ends too early")
        found = self.tokens[self.token]
        if value and found[1] != value:
            raise self.fail(f"expected {value!r}, got {found[1]!r}")
        self.token += 1
        return found

    def binary(self, level: int) -> str:
        if level == len(_BINARY):
            return self.comparison()
        left = self.binary(level + 1)
        while self.next_is(*_BINARY[level]):
            operator = _BINARY[level][self.take()[1]]
            right = self.binary(level + 1)
            left = f"(bool({left}) ^ bool({right}))" if operator == "^" else f"({left} {operator} {right})"
        return left

    def comparison(self) -> str:
        left = self.sum()
        if self.next_is(*_COMPARE):
            return f"({left} {self.take()[1]} {self.sum()})"
        return left

    def sum(self) -> str:
        left = self.product()
        while self.next_is("+", "-"):
            left = f"({left} {self.take()[1]} {self.product()})"
        return left

    def product(self) -> str:
        left = self.unary()
        while self.next_is("*", "/", "%"):
            left = f"({left} {self.take()[1]} {self.unary()})"
        return left

    def unary(self) -> str:
        if self.next_is("-", "+"):
            return f"({self.take()[1]}{self.unary()})"
        if self.next_is("not"):
            self.take()
            return f"(not {self.comparison()})"
        base = self.postfix()
        if self.next_is("^"):
            self.take()
            return f"({base} ** {self.unary()})"
        return base

    def postfix(self) -> str:
        made = self.atom()
        while self.next_is("["):
            self.take()
            made = f"{made}[{self.binary(0)}]"
            while self.next_is(","):
                self.take()
                made = f"{made}[{self.binary(0)}]"
            self.take("]")
        return made

    def atom(self) -> str:
        kind, text = self.take()
        if kind == "number":
            return text if not re.fullmatch(r"0\d+", text) else text.lstrip("0")
        if kind == "string":
            return repr(text[1:-1])
        if kind == "pose":
            self.take("[")
            return f"PoseValue(({self.items(']')}))"
        if text == "[":
            return f"Array(({self.items(']')}))"
        if text == "(":
            inner = self.binary(0)
            self.take(")")
            return f"({inner})"
        if kind != "name":
            raise self.fail(f"{text!r} is unexpected")
        if text in ("True", "False"):
            return text
        if text == "run":
            name = self.take()[1]
            self.take("(")
            arguments = self.items(")")
            return f"_run(f_{name}, ({arguments}))"
        if self.next_is("("):
            self.take()
            self.inside[-1].calls.add(text)
            return f"\0{text}({self.items(')')})\1"  # the writer knows whether it blocks
        return f"v_{text}"

    def items(self, close: str) -> str:
        parts = []
        while not self.next_is(close):
            if self.token + 1 < len(self.tokens) and self.tokens[self.token + 1][1] == "=":
                parts.append(f"\2{self.take()[1]}{self.take('=')[1]}{self.binary(0)}")
            else:
                parts.append(self.binary(0))
            if not self.next_is(close):
                self.take(",")
        self.take(close)
        return "".join(part + ", " for part in parts)


class _Writer:
    """Python source from the tree."""

    def __init__(self, program: _Function, parser: _Parser, builtins: Set[str], blocking: Set[str]) -> None:
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
