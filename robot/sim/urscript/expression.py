"""Expressions of URScript, by precedence climbing, into Python text.

In that text a call is written as NUL name ( arguments ) SOH, and a named argument as STX name = value: whether a
function is the program's own, and whether it takes time, is known only when the whole program has been read.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from .arithmetic import MAX_ITEMS
from .values import ScriptError

__all__ = ["ExpressionParser"]

MAX_DEPTH = 50  #: of an expression: brackets, signs, powers
#: next token of an expression, after any blanks
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<string>\"[^\"]*\"|'[^']*')|(?P<pose>p(?=\[))"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<op>==|!=|<=|>=|[-+*/%^<>=()\[\],:.]))"
)
#: logical operators of URScript -> of Python, by rising precedence
_BINARY = ({"or": "or", "xor": "^"}, {"and": "and"})
_SUM = {"+": "_add", "-": "_subtract"}
_PRODUCT = {"*": "_multiply", "/": "_divide", "%": "_modulo"}
#: comparison operators
_COMPARISONS = {"==", "!=", "<", ">", "<=", ">="}


class ExpressionParser:
    """Parser of one expression after the other.

    Args:
        fail: returns the error that says a problem and the line.
        calls: takes the name of each function that an expression calls.
    """

    def __init__(self, fail: Callable[[str], ScriptError], calls: Callable[[str], None]) -> None:
        self._fail = fail
        self._calls = calls
        self._tokens: list[tuple[str, str]] = []
        self._token = self._depth = 0

    def parse(self, text: str) -> str:
        """Return the expression as Python text.

        Raises:
            ScriptError: it is none.
        """
        self._read(text)
        made = self._binary(0)
        if self._token < len(self._tokens):
            raise self._fail(f"{self._tokens[self._token][1]!r} is unexpected")
        return made

    def parameters(self, text: str) -> list[tuple[str, str]]:
        """Return the name of each parameter of a definition, and its default as Python text: empty without one.

        Raises:
            ScriptError: the text is no list of parameters.
        """
        self._read(text)
        found: list[tuple[str, str]] = []
        while self._token < len(self._tokens):
            kind, name = self._take()
            if kind != "name" or any(name == known for known, _ in found) or len(found) >= MAX_ITEMS:
                raise self._fail("parameters must be plain names, each once")
            default = ""
            if self._next_is("="):
                self._take()
                default = self._binary(0)
            found.append((name, default))
            if self._token < len(self._tokens):
                self._take(",")
        return found

    def _read(self, text: str) -> None:
        """Cut a text into tokens."""
        self._tokens, self._token, self._depth, position = [], 0, 0, 0
        text = text.rstrip()
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                raise self._fail(f"{text[position:]!r} is not URScript")
            self._tokens.append((match.lastgroup or "", match[match.lastgroup or 0]))
            position = match.end()

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
        if self._next_is(*_COMPARISONS):
            return f"({left} {self._take()[1]} {self._sum()})"
        return left

    def _sum(self) -> str:
        left = self._product()
        while self._next_is("+", "-"):
            left = f"{_SUM[self._take()[1]]}({left}, {self._product()})"
        return left

    def _product(self) -> str:
        left = self._unary()
        while self._next_is("*", "/", "%"):
            left = f"{_PRODUCT[self._take()[1]]}({left}, {self._unary()})"
        return left

    def _unary(self) -> str:
        if self._depth > MAX_DEPTH:
            raise self._fail(f"more than {MAX_DEPTH} levels of an expression")
        self._depth += 1
        made = self._signed()
        self._depth -= 1
        return made

    def _signed(self) -> str:
        if self._next_is("-", "+"):
            return f"_negate({self._unary()})" if self._take()[1] == "-" else self._unary()
        if self._next_is("not"):
            self._take()
            return f"(not {self._comparison()})"
        base = self._postfix()
        if self._next_is("^"):
            self._take()
            return f"_power({base}, {self._unary()})"
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
            whole = text.isdigit()
            return f"{text}.0" if whole and len(text) > 9 else (text.lstrip("0") or "0") if whole else text
        if kind == "string":
            return repr(text[1:-1])
        if kind == "pose":
            self._take("[")
            parts = self._items("]")
            if len(parts) == 1:  # not a pose, but an element of a variable named p
                return f"v_p[{parts[0]}]"
            return f"_pose(({_tuple(parts)}))"
        if text == "[":
            return f"_list(({_tuple(self._items(']'))}))"
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
            self._calls(text)
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
            if len(parts) > MAX_ITEMS:
                raise self._fail(f"more than {MAX_ITEMS} elements or arguments")
        self._take(close)
        return parts


def _tuple(parts: list[str]) -> str:
    return "".join(part + ", " for part in parts)
