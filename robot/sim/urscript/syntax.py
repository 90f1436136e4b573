"""Tokens of URScript, and its expressions as Python text, by precedence climbing.

A line ends a statement where no bracket is open and no operator waits for its other side. ur_rtde writes a value at the
start of the next line, and interpreter mode has whole functions in one line: both are the same to this parser.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Set
from typing import NamedTuple

from .values import CHANGING_METHODS, MAX_ITEMS, ScriptError


class _Token(NamedTuple):
    """Word, number, text or sign of a program."""

    kind: str  #: "name", "number", "string", "sign", or "end" after the last one
    text: str  #: as it is written
    line: int  #: number of its line, from 1
    first: bool  #: True for the first one of its line


#: next token, after any blanks
_NEXT_TOKEN = re.compile(
    r"[^\S\n]*(?:(?P<line>\n)|(?P<comment>#[^\n]*)|(?P<number>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<string>\"[^\"\n]*\"|'[^'\n]*')|(?P<name>[A-Za-z_]\w*)|(?P<sign>==|!=|<=|>=|[-+*/%^<>=()\[\],:.!])|(?P<end>\Z))",
    re.ASCII,
)
_PLACE_MARK = re.compile(r"[^\S\n]*\$[^\n]*")  # what PolyScope writes to show where its program is: $ 2 "MoveJ"


def _tokens_of(text: str) -> list[_Token]:
    """Cut a program into tokens, and add an "end" to them.

    Raises:
        ScriptError: a part of it is not URScript.
    """
    found: list[_Token] = []
    position, line, first = 0, 1, True
    while True:
        if first and (mark := _PLACE_MARK.match(text, position)):
            position = mark.end()
        match = _NEXT_TOKEN.match(text, position)
        if match is None:
            raise line_error(text, line, f"{text[position:].partition(chr(10))[0].strip()[:99]!r} is not URScript")
        position, kind = match.end(), match.lastgroup or ""
        if kind == "line":
            line, first = line + 1, True
        elif kind != "comment":
            found.append(_Token(kind, match[kind], line, first or kind == "end"))
            if kind == "end":
                return found
            first = False


def line_error(text: str, line: int, problem: str, *, running: bool = False) -> ScriptError:
    """Return the error of one line of a program, with its number and its text; also of one that was running."""
    lines = text.split("\n")
    words = lines[line - 1].strip() if 0 < line <= len(lines) else ""
    title = problem if running else f"syntax_error_on_line:{line}:{words}:"
    return ScriptError(f"line {line}: {problem} in {words[:200]!r}", title=title, line=line, column=1)


_MAX_DEPTH = 50  # of an expression: brackets, signs, powers
#: operators of two sides -> their Python, by rising precedence
_BINARY_OPERATORS = (
    {"or": "({} or {})", "xor": "(bool({}) ^ bool({}))"},
    {"and": "({} and {})"},
    {sign: f"({{}} {sign} {{}})" for sign in ("==", "!=", "<", ">", "<=", ">=")},
    {"+": "_add({}, {})", "-": "_subtract({}, {})"},
    {"*": "_multiply({}, {})", "/": "_divide({}, {})", "%": "_modulo({}, {})"},
)
_COMPARISON_LEVEL = 2
_NOT_SIMULATED = {"time"}
#: words that can be no variable
_RESERVED_WORDS = {"def", "sec", "thread", "end", "if", "elif", "else", "while", "switch", "case", "default", "return"}
_RESERVED_WORDS |= {"break", "continue", "halt", "global", "local"}
_NAMED_VALUES = {"True": "True", "False": "False", "None": "None"}


class ExpressionParser:
    """Parser of expressions, in the order in which they stand in a program.

    Args:
        functions: names of its own functions.
        builtins: names of the controller's functions -> whether they take time, and are therefore generators.
    """

    def __init__(self, text: str, functions: Set[str], builtins: Mapping[str, bool]) -> None:
        self._text = text
        self._functions, self._builtins = functions, builtins
        self._tokens = _tokens_of(text)
        self._at = self._depth = self._brackets = 0

    # tokens

    @property
    def _token(self) -> _Token:
        return self._tokens[self._at]

    def _next_is(self, *texts: str) -> bool:
        """Return whether the statement goes on with one of these."""
        kind, text, _, first = self._tokens[self._at]
        return text in texts and kind != "string" and not (first and self._brackets == 0)

    def _take(self, text: str = "") -> _Token:
        token = self._tokens[self._at]
        if token.kind == "end" or (text and token.text != text):
            late = token.first and (self._brackets == 0 or token.text in _RESERVED_WORDS)
            found = "the end of the line" if late else repr(token.text) if token.text else "the end of the program"
            raise self._fail(f"expected {text!r}, got {found}" if text else "the line ends too early", before=late)
        self._at += 1
        return token

    def _fail(self, problem: str, before: bool = False) -> ScriptError:
        """Return the error of the line of the next token, or of the one before it."""
        return line_error(self._text, self._tokens[max(0, self._at - before)].line, problem)

    # expressions

    def expression(self, level: int = 0) -> str:
        """Return the next expression as Python text, from one level of precedence on.

        Raises:
            ScriptError: there is none.
        """
        if level == len(_BINARY_OPERATORS):
            return self._unary()
        left = self.expression(level + 1)
        while self._next_is(*_BINARY_OPERATORS[level]):
            made = _BINARY_OPERATORS[level][self._take().text]
            left = made.format(left, self.expression(level + 1))
            if level == _COMPARISON_LEVEL:
                break  # there is no a < b < c
        return left

    def _unary(self) -> str:
        if self._depth > _MAX_DEPTH:
            raise self._fail(f"more than {_MAX_DEPTH} levels of an expression")
        self._depth += 1
        made = self._signed()
        self._depth -= 1
        return made

    def _signed(self) -> str:
        if self._token.kind == "sign" and self._token.text in "-+!":
            sign = self._take().text
            made = self._unary()
            return {"-": f"_negate({made})", "!": f"(not {made})"}.get(sign, made)
        if self._token == ("name", "not", *self._token[2:]):
            self._take()
            return f"(not {self.expression(_COMPARISON_LEVEL)})"
        base = self._postfix()
        if self._next_is("^"):
            self._take()
            return f"_power({base}, {self._unary()})"
        return base

    def _postfix(self) -> str:
        """Parse an operand with its elements, members and calls of methods."""
        name = self._token.text
        made, keys = self._atom(), ""
        variable = made == f"v_{name}"
        while self._next_is("[", "."):
            if self._take().text == "[":
                keys += self._inside(self._keys)
                continue
            member = self._name()
            if not self._next_is("("):
                keys += f"{member!r}, "
                continue
            self._take()
            call = f"{member!r}, ({self._inside(self._items)})"
            if variable and member in CHANGING_METHODS:
                self._changed(name)
                call = f"(_r := (yield from _method(v_{name}, ({keys}), {call}))"
                made = f"{call}, (v_{name} := _r[0]), _r[1])[2]"
            else:
                made = f"(yield from _method({made}, ({keys}), {call}))[1]"
            variable, keys = False, ""
        return f"_at({made}, {keys})" if keys else made

    def _keys(self) -> str:
        """Parse the places of an element up to its bracket, and return them as Python text with a comma after each."""
        made = f"{self.expression()}, "
        while self._next_is(","):
            self._take()
            made += f"{self.expression()}, "
        self._take("]")
        return made

    def _name(self) -> str:
        if self._token.kind != "name":
            raise self._fail(f"expected a name, got {self._token.text!r}")
        return self._take().text

    def _inside(self, parse: Callable[[], str]) -> str:
        """Parse what stands inside of brackets, where the end of a line ends nothing."""
        self._brackets += 1
        made = parse()
        self._brackets -= 1
        return made

    def _changed(self, name: str) -> None:
        """Note that a statement changes a variable."""

    def _atom(self) -> str:
        kind, text, line, _ = self._take()
        if kind == "number":
            if text[:2] in ("0x", "0X"):
                return str(int(text, 16)) if int(text, 16) < 2**31 else f"{int(text, 16)}.0"
            whole = text.isdigit()
            return f"{text}.0" if whole and len(text) > 9 else (text.lstrip("0") or "0") if whole else text
        if kind == "string":
            return repr(text[1:-1])
        if text == "[":
            return f"_list(({self._inside(lambda: self._items(']'))}))"
        if text == "(":
            return self._inside(self._bracketed)
        if kind != "name" or text in _RESERVED_WORDS:
            self._at -= 1
            raise self._fail(f"{text!r} is unexpected", before=kind == "name" and self._token.first)
        if text in _NAMED_VALUES:
            return _NAMED_VALUES[text]
        if text == "p" and self._next_is("["):
            self._take()
            parts = self._inside(lambda: self._items("]"))
            return f"_at(v_p, {parts})" if self._count == 1 else f"_pose(({parts}))"  # a variable named p has elements
        if text == "run":
            name = self._name()
            self._take("(")
            return f"_run({self._python_name(name, line)}, ({self._inside(self._items)}))"
        if not self._next_is("("):
            return f"v_{text}"
        self._take()
        if text == "struct":
            return f"_struct({{{self._inside(lambda: self._items(named='{!r}: '))}}})"
        own = text in self._functions
        name = self._python_name(text, line)
        arguments = self._inside(lambda: self._items(named="v_{}=" if own else "{}="))
        return f"(yield from {name}({arguments}))" if own or self._builtins[text] else f"{name}({arguments})"

    def _python_name(self, name: str, line: int) -> str:
        """Return the Python name of a function.

        Raises:
            ScriptError: the program has none of that name, and the controller neither.
        """
        if name in self._functions:
            return f"f_{name}"
        if name in self._builtins:
            return f"b_{name}"
        words = self._text.split("\n")[line - 1]
        known = " (URScript, but not simulated)" if name in _NOT_SIMULATED else ""
        raise ScriptError(
            f"line {line}: the controller has no function {name}{known} in {words.strip()[:200]!r}",
            title=f"compile_error_name_not_found:{name}:",
            line=line,
            column=words.find(name) + 1,
        )

    _count = 0  # of the elements that were parsed last

    def _bracketed(self) -> str:
        made = self.expression()
        self._take(")")
        return f"({made})"

    def _items(self, close: str = ")", *, named: str = "") -> str:
        """Parse elements or arguments up to a bracket, as Python text with a comma after each.

        Args:
            close: the bracket.
            named: Python for the name of one that has one, such as ``{}=``; empty where none may have one.
                ``{!r}: `` is that of a struct, whose members all need one.
        """
        made, count = "", 0
        while not self._next_is(close):
            if named and self._token.kind == "name" and self._tokens[self._at + 1].text == "=":
                made += named.format(self._take().text)
                self._take("=")
            elif named.endswith(": "):
                raise self._fail("a member of a struct needs a name: struct(x=1)")
            made += f"{self.expression()}, "
            count += 1
            if not self._next_is(close):
                self._take(",")
            if count > MAX_ITEMS:
                raise self._fail(f"more than {MAX_ITEMS} elements or arguments")
        self._take(close)
        self._count = count
        return made
