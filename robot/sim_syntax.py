"""The grammar of URScript, as far as `sim_urscript` says: lines to a tree of statements, expressions to Python text.

In that text a call is written as NUL name ( arguments ) SOH, and a named argument as STX name = value: whether a
function is the program's own, and whether it takes time, is known only when the whole program has been read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from .sim_values import ScriptError

__all__ = ["Function", "Parser"]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<string>\"[^\"]*\"|'[^']*')|(?P<pose>p(?=\[))"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<op>==|!=|<=|>=|[-+*/%^<>=()\[\],:.]))"
)
_BINARY = ({"or": "or", "xor": "^"}, {"and": "and"})
_COMPARE = {"==", "!=", "<", ">", "<=", ">="}


@dataclass(slots=True)
class Function:
    """One def, sec or thread: a tree of statements (kind, line number, parts...)."""

    kind: str
    name: str
    parameters: list[str]
    body: list[tuple[object, ...]] = field(default_factory=list)
    assigned: set[str] = field(default_factory=set)
    elements: set[str] = field(default_factory=set)  # names whose elements are assigned
    calls: set[str] = field(default_factory=set)


class Parser:
    """Statements by line, expressions by precedence climbing; expressions come out as Python text.

    Takes numbered lines without comments and blanks, as `sim_urscript` cuts them.

    Attributes:
        functions: what has been defined, by name.
        globals: names that were declared global.
    """

    def __init__(self, lines: list[tuple[int, str]]) -> None:
        self._lines = lines
        self._at = 0
        self.functions: dict[str, Function] = {}
        self.globals: set[str] = set()
        self._inside: list[Function] = []
        self._tokens: list[tuple[str, str]] = []
        self._token = 0

    def program(self) -> Function:
        """The whole text: one def or sec, with what is defined in it.

        Raises:
            ScriptError: it is not URScript, or something follows its end.
        """
        made = self._function()
        if self._peek() is not None:
            raise self._fail("something stands after the end of the program")
        return made

    def _peek(self) -> str | None:
        return self._lines[self._at][1] if self._at < len(self._lines) else None

    def _fail(self, problem: str) -> ScriptError:
        number, line = self._lines[min(self._at, len(self._lines) - 1)]
        return ScriptError(f"line {number}: {problem} in {line!r}")

    # statements

    def _function(self) -> Function:
        match = re.fullmatch(r"(def|sec|thread)\s+(\w+)\s*\(([^)]*)\)\s*:", self._lines[self._at][1])
        if match is None:
            raise self._fail("expected 'def name():'")
        names = [part.strip() for part in match[3].split(",") if part.strip()]
        if not all(name.isidentifier() for name in names):
            raise self._fail("parameters must be plain names")
        made = Function(match[1], match[2], names)
        self.functions[made.name] = made
        self._inside.append(made)
        self._at += 1
        made.body = self._block(("end",))
        self._at += 1
        self._inside.pop()
        return made

    def _block(self, ends: tuple[str, ...]) -> list[tuple[object, ...]]:
        body: list[tuple[object, ...]] = []
        while (line := self._peek()) is not None:
            word = re.match(r"\w*", line)
            if word is not None and word[0] in ends:
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
        test = self._expression(text[:-1])
        self._at += 1
        return test

    def _simple(self, line: str, word: str, number: int) -> tuple[object, ...]:
        rest = line[len(word) :].strip()
        if word in ("break", "continue", "halt", "pass", "enter_critical", "exit_critical"):
            return word, number
        if word == "return":
            return word, number, self._expression(rest) if rest else "None"
        if word in ("kill", "join"):
            return word, number, self._expression(rest)
        here = self._inside[-1]
        match = re.match(r"(?:(global|local)\s+)?([A-Za-z_]\w*)\s*((?:\[[^=\]]*\])?)\s*=(?!=)(.*)$", line)
        if match is None:
            return "call", number, self._expression(line)
        scope, name, index, value = match.groups()
        if scope == "global":
            self.globals.add(name)
        if index:
            here.elements.add(name)
            key = self._expression(index[1:-1])
            return "element", number, name, key, self._expression(value)
        if scope != "local" or name not in self.globals:
            here.assigned.add(name)
        return "set", number, name, self._expression(value)

    # expressions

    def _expression(self, text: str) -> str:
        self._tokens, self._token, position = [], 0, 0
        text = text.rstrip()
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                raise self._fail(f"{text[position:]!r} is not URScript")
            self._tokens.append((match.lastgroup or "", match[match.lastgroup or 0]))
            position = match.end()
        made = self._binary(0)
        if self._token < len(self._tokens):
            raise self._fail(f"{self._tokens[self._token][1]!r} is unexpected")
        return made

    def _next_is(self, *values: str) -> bool:
        return self._token < len(self._tokens) and self._tokens[self._token][1] in values

    def _take(self, value: str = "") -> tuple[str, str]:
        if self._token >= len(self._tokens):
            raise self._fail("the line ends too early")
        found = self._tokens[self._token]
        if value and found[1] != value:
            raise self._fail(f"expected {value!r}, got {found[1]!r}")
        self._token += 1
        return found

    def _binary(self, level: int) -> str:
        if level == len(_BINARY):
            return self._comparison()
        left = self._binary(level + 1)
        while self._next_is(*_BINARY[level]):
            operator = _BINARY[level][self._take()[1]]
            right = self._binary(level + 1)
            left = f"(bool({left}) ^ bool({right}))" if operator == "^" else f"({left} {operator} {right})"
        return left

    def _comparison(self) -> str:
        left = self._sum()
        if self._next_is(*_COMPARE):
            return f"({left} {self._take()[1]} {self._sum()})"
        return left

    def _sum(self) -> str:
        left = self._product()
        while self._next_is("+", "-"):
            left = f"({left} {self._take()[1]} {self._product()})"
        return left

    def _product(self) -> str:
        left = self._unary()
        while self._next_is("*", "/", "%"):
            left = f"({left} {self._take()[1]} {self._unary()})"
        return left

    def _unary(self) -> str:
        if self._next_is("-", "+"):
            return f"({self._take()[1]}{self._unary()})"
        if self._next_is("not"):
            self._take()
            return f"(not {self._comparison()})"
        base = self._postfix()
        if self._next_is("^"):
            self._take()
            return f"({base} ** {self._unary()})"
        return base

    def _postfix(self) -> str:
        made = self._atom()
        while self._next_is("["):
            self._take()
            made = f"{made}[{self._binary(0)}]"
            while self._next_is(","):
                self._take()
                made = f"{made}[{self._binary(0)}]"
            self._take("]")
        return made

    def _atom(self) -> str:
        kind, text = self._take()
        if kind == "number":
            return text if not re.fullmatch(r"0\d+", text) else text.lstrip("0")
        if kind == "string":
            return repr(text[1:-1])
        if kind == "pose":
            self._take("[")
            parts = self._items("]")
            if len(parts) == 1:  # not a pose, but an element of a variable that is called p
                return f"v_p[{parts[0]}]"
            return f"PoseValue(({_tuple(parts)}))"
        if text == "[":
            return f"Array(({_tuple(self._items(']'))}))"
        if text == "(":
            inner = self._binary(0)
            self._take(")")
            return f"({inner})"
        if kind != "name":
            raise self._fail(f"{text!r} is unexpected")
        if text in ("True", "False"):
            return text
        if text == "run":
            name = self._take()[1]
            self._take("(")
            return f"_run(f_{name}, ({_tuple(self._items(')'))}))"
        if self._next_is("("):
            self._take()
            self._inside[-1].calls.add(text)
            return f"\0{text}({_tuple(self._items(')'))})\1"  # the writer knows whether it blocks
        return f"v_{text}"

    def _items(self, close: str) -> list[str]:
        parts = []
        while not self._next_is(close):
            if self._token + 1 < len(self._tokens) and self._tokens[self._token + 1][1] == "=":
                parts.append(f"\2{self._take()[1]}{self._take('=')[1]}{self._binary(0)}")
            else:
                parts.append(self._binary(0))
            if not self._next_is(close):
                self._take(",")
        self._take(close)
        return parts


def _tuple(parts: list[str]) -> str:
    return "".join(part + ", " for part in parts)
