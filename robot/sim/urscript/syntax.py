"""Parser of URScript: text to numbered lines, lines to a tree of statements, expressions to Python text.

Expressions are parsed by precedence climbing. In their Python text a call is written as NUL name ( arguments ) SOH, and
a named argument as STX name = value: whether a function is the program's own, and whether it takes time, is known only
when the whole program has been read. `translator` says what is understood.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from .values import MAX_ITEMS, ScriptError

_UNFINISHED_LINE = re.compile(r"(?:,|\b(?:and|or|xor|not))$")  # end of a line that goes on in the next
_LEADING_NUMBER = re.compile(r"[-+]?[\d.eE]+")
_QUOTED_TEXT = re.compile(r"\"[^\"]*\"|'[^']*'")


def numbered_lines(text: str) -> list[tuple[int, str]]:
    """Return a program's lines, each with the number of its first one, from 1.

    A line goes on in the next while a bracket is open, or after a comma or a logical operator. What PolyScope writes to
    show where its program is, ``$ 2 "MoveJ"``, is left out. ur_rtde writes the value of ``global offset =`` at the
    start of the next line, before that line's own statement.
    """
    lines: list[tuple[int, str]] = []
    parts: list[str] = []  # of a line that goes on
    first = depth = 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = (raw if "#" not in raw else _without_comment(raw)).strip()
        if not line or line.startswith("$"):
            continue
        if not parts and lines and lines[-1][1].endswith("=") and (value := _LEADING_NUMBER.match(line)):
            lines[-1] = (lines[-1][0], f"{lines[-1][1]} {value[0]}")
            line = line[value.end() :].strip()
            if not line:
                continue
        first = first if parts else number
        parts.append(line)
        depth = max(0, depth + _opened(line))
        if depth == 0 and not _UNFINISHED_LINE.search(line):
            lines.append((first, " ".join(parts)))
            parts = []
    return [*lines, (first, " ".join(parts))] if parts else lines


def _opened(line: str) -> int:
    """Return how many brackets a line opens and does not close."""
    bare = _QUOTED_TEXT.sub("", line) if '"' in line or "'" in line else line
    return bare.count("(") + bare.count("[") - bare.count(")") - bare.count("]")


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


_MAX_DEPTH = 50  # of an expression: brackets, signs, powers
#: next token of an expression, after any blanks
_NEXT_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<string>\"[^\"]*\"|'[^']*')|(?P<pose>p(?=\[))"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<op>==|!=|<=|>=|[-+*/%^<>=()\[\],:.]))"
)
#: operators of two sides -> their Python, by rising precedence
_BINARY_OPERATORS = (
    {"or": "({} or {})", "xor": "(bool({}) ^ bool({}))"},
    {"and": "({} and {})"},
    {sign: f"({{}} {sign} {{}})" for sign in ("==", "!=", "<", ">", "<=", ">=")},
    {"+": "_add({}, {})", "-": "_subtract({}, {})"},
    {"*": "_multiply({}, {})", "/": "_divide({}, {})", "%": "_modulo({}, {})"},
)
_COMPARISON_LEVEL = 2


class _ExpressionParser:
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
            match = _NEXT_TOKEN.match(text, position)
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
        """Parse from one level of precedence on."""
        if level == len(_BINARY_OPERATORS):
            return self._unary()
        left = self._binary(level + 1)
        while self._next_is(*_BINARY_OPERATORS[level]):
            made = _BINARY_OPERATORS[level][self._take()[1]]
            left = made.format(left, self._binary(level + 1))
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
        if self._next_is("-", "+"):
            return f"_negate({self._unary()})" if self._take()[1] == "-" else self._unary()
        if self._next_is("not"):
            self._take()
            return f"(not {self._binary(_COMPARISON_LEVEL)})"
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


_MAX_BLOCKS = 20  # of blocks inside each other
_MAX_FUNCTIONS = 1000  # of one program


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

    It takes the lines of `numbered_lines`.

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
        self._expressions = _ExpressionParser(self._fail, self._note_call)

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
        if match[2] in self.functions or len(self.functions) >= _MAX_FUNCTIONS:
            raise self._fail(f"a function is defined twice, or there are more than {_MAX_FUNCTIONS}")
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
        if self._blocks > _MAX_BLOCKS:
            raise self._fail(f"more than {_MAX_BLOCKS} blocks inside each other")
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
