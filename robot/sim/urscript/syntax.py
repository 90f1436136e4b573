"""Parser of URScript, as far as `urscript` says: lines to a tree of statements, expressions to Python text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from .expression import ExpressionParser
from .values import ScriptError

__all__ = ["Function", "Parser"]

MAX_BLOCKS = 20  #: of blocks inside each other
MAX_FUNCTIONS = 1000  #: of one program


@dataclass(slots=True)
class Function:
    """Function, ``sec`` or thread of a program: a tree of statements (kind, line number, parts...).

    Attributes:
        kind: "def", "sec" or "thread".
        name: name of the function.
        parameters: name of each parameter -> Python text of its default; empty without one.
        body: its statements.
        assigned: names that it assigns.
        elements: names whose elements it assigns.
        local: names that it declares local.
        outer: names that the program's own body assigns before it.
        calls: name of each function that it calls -> the first line that does.
    """

    kind: str
    name: str
    parameters: dict[str, str] = field(default_factory=dict)
    body: list[tuple[object, ...]] = field(default_factory=list)
    assigned: set[str] = field(default_factory=set)
    elements: set[str] = field(default_factory=set)
    local: set[str] = field(default_factory=set)
    outer: frozenset[str] = frozenset()
    calls: dict[str, int] = field(default_factory=dict)


class Parser:
    """Parser of statements line by line, into a tree.

    It takes numbered lines without comments and blank lines, as `urscript` prepares them.

    Attributes:
        functions: name -> function defined so far.
        globals: names declared global.
    """

    def __init__(self, lines: list[tuple[int, str]]) -> None:
        self._lines = lines
        self._at = self._blocks = 0
        self.functions: dict[str, Function] = {}
        self.globals: set[str] = set()
        self._inside: list[Function] = []
        self._expressions = ExpressionParser(self._fail, self._note_call)

    def program(self) -> Function:
        """Parse the whole text: one def or sec, with the functions defined in it.

        Raises:
            ScriptError: the text is not URScript, or goes on after the program's end.
        """
        made = self._function()
        if self._peek() is not None:
            raise self._fail("text after the end of the program")
        return made

    def _peek(self) -> str | None:
        return self._lines[self._at][1] if self._at < len(self._lines) else None

    def _fail(self, problem: str) -> ScriptError:
        number, line = self._lines[min(self._at, len(self._lines) - 1)]
        title = f"syntax_error_on_line:{number}:{line}:"
        return ScriptError(f"line {number}: {problem} in {line!r}", title=title, line=number, column=1)

    def _note_call(self, name: str) -> None:
        self._inside[-1].calls.setdefault(name, self._lines[self._at][0])

    # statements

    def _function(self) -> Function:
        match = re.fullmatch(r"(def|sec|thread)\s+(\w+)\s*\((.*)\)\s*:", self._lines[self._at][1])
        if match is None:
            raise self._fail("expected 'def name():'")
        if match[2] in self.functions or len(self.functions) >= MAX_FUNCTIONS:
            raise self._fail(f"a function is defined twice, or there are more than {MAX_FUNCTIONS}")
        made = Function(match[1], match[2])
        if self._inside:
            made.outer = frozenset(self._inside[0].assigned)
        self.functions[made.name] = made
        self._inside.append(made)
        for name, default in self._expressions.parameters(match[3]):
            made.parameters[name] = default
        self._at += 1
        made.body = self._block(("end",))
        self._at += 1
        self._inside.pop()
        return made

    def _block(self, ends: tuple[str, ...]) -> list[tuple[object, ...]]:
        body: list[tuple[object, ...]] = []
        self._blocks += 1
        if self._blocks > MAX_BLOCKS:
            raise self._fail(f"more than {MAX_BLOCKS} blocks inside each other")
        while (line := self._peek()) is not None:
            word = re.match(r"\w*", line)
            if word is not None and word[0] in ends:
                self._blocks -= 1
                return body
            body += self._statement(line, word[0] if word else "")
        raise self._fail("a block has no 'end'")

    def _statement(self, line: str, word: str) -> Iterator[tuple[object, ...]]:
        number = self._lines[self._at][0]
        if word in ("def", "thread"):
            self._function()
            return
        if word == "if":
            branches = [(self._condition(line[2:]), self._block(("elif", "else", "end")))]
            otherwise: list[tuple[object, ...]] = []
            while (line := self._peek() or "").startswith("elif"):
                branches.append((self._condition(line[4:]), self._block(("elif", "else", "end"))))
            if line.startswith("else"):
                self._at += 1
                otherwise = self._block(("end",))
            self._at += 1
            yield "if", number, branches, otherwise
            return
        if word == "while":
            test = self._condition(line[5:])
            body = self._block(("end",))
            self._at += 1
            yield "while", number, test, body
            return
        yield self._simple(line, word, number)
        self._at += 1

    def _condition(self, text: str) -> str:
        text = text.strip()
        if not text.endswith(":"):
            raise self._fail("expected ':' at the end")
        test = self._expressions.parse(text[:-1])
        self._at += 1
        return test

    def _simple(self, line: str, word: str, number: int) -> tuple[object, ...]:
        rest = line[len(word) :].strip()
        if word in ("break", "continue", "halt", "pause", "pass", "enter_critical", "exit_critical"):
            return word, number
        if word == "return":
            return word, number, self._expressions.parse(rest) if rest else "None"
        if word in ("kill", "join"):
            return word, number, self._expressions.parse(rest)
        here = self._inside[-1]
        match = re.match(r"(?:(global|local)\s+)?([A-Za-z_]\w*)\s*((?:\[[^=\]]*\])?)\s*=(?!=)(.*)$", line)
        if match is None:
            return "call", number, self._expressions.parse(line)
        scope, name, index, value = match.groups()
        if scope == "global":
            self.globals.add(name)
        if index:
            here.elements.add(name)
            key = self._expressions.parse(index[1:-1])
            return "element", number, name, key, self._expressions.parse(value)
        if scope == "local":
            here.local.add(name)
        here.assigned.add(name)
        return "set", number, name, self._expressions.parse(value)
