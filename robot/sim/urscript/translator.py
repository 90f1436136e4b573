"""Translator from URScript to Python, with which the simulated controller runs the program that ur_rtde uploads.

A program becomes a Python module of generators: each ``yield`` ends the thread's turn in the control cycle, where it
waits, and in a loop that has used the thread's share of it. So the quirks of a program are those of its own text;
nothing in this module knows ur_rtde.

Understood: def, sec, thread, if/elif/else, while, switch/case/default, break, continue, return, halt, global, local,
assignment (also to an element or a member), run, kill, join, pause, assert, enter_critical, exit_critical, lists,
matrices, structs and their methods, poses, parameters with a default, named arguments, arithmetic and logic. A name
assigned in a function is local to it if it says so, or if no variable of that name is declared global anywhere or
assigned in the program's own body before the function. A case of a switch does not go on in the next one. A critical
section ends no turn and holds nobody up: a thread gives way only where it waits, and the program of Universal Robots'
own driver waits for its socket in one while another of its threads moves the arm.

Source: Universal Robots, "The URScript Programming Language", chapters 3 to 9 (types, matrices, flow of control,
functions, scoping rules, threads) and its page "Thread scheduling".
"""

from __future__ import annotations

import marshal
import re
from collections import deque
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from .syntax import ExpressionParser, line_error
from .values import ScriptError

MAX_LENGTH = 512_000  #: characters of a program; an export of PolyScope has up to 370 000
#: first word of a line that an ``end`` must close, and that ``end``; both where one line has it all, too
_BLOCK_START = re.compile(r"(?:^|:)\s*(?:def|sec|thread|if|while|switch)\b")
_BLOCK_END = re.compile(r"(?<!\.)\bend\b(?!\s*[=(.])")
_DEFINED_NAME, _CALLED_NAME = re.compile(r"\s*def\s+(\w+)"), re.compile(r"(\w+)\s*\(")
_QUOTED_TEXT_AND_COMMENT = re.compile(r"\"[^\"]*\"|'[^']*'|#.*")


@dataclass(frozen=True, slots=True)
class Names:
    """Names that a program has: interpreter mode goes on with them."""

    functions: frozenset[str] = frozenset()  #: that it defines
    shared: frozenset[str] = frozenset()  #: variables that all of its functions see


@dataclass(frozen=True, slots=True)
class Translation:
    """Program that is ready to run."""

    name: str  #: name in the program's text
    secondary: bool  #: True for a ``sec`` program, which runs beside the main one and cannot move the arm
    code: bytes  #: marshalled Python module that defines ``main``, a generator function, and the functions that it uses
    text: str  #: of the program
    lines: tuple[int, ...]  #: line of the program for each line of the module
    names: Names  #: what it defines

    def located(self, problem: Exception) -> ScriptError:
        """Return what went wrong while it ran as an error that names the line of the program."""
        number, trace = 0, problem.__traceback__
        while trace is not None:
            if trace.tb_frame.f_code.co_filename == f"<{self.name}>":
                number = self.lines[trace.tb_lineno - 1]
            trace = trace.tb_next
        words = str(problem) if isinstance(problem, ScriptError) else f"{type(problem).__name__}: {problem}"
        if isinstance(problem, NameError) and (match := re.search(r"'v_(\w+)'", words)):
            words = f"the variable {match[1]} has no value"
        return line_error(self.text, number, words[:1000], running=True) if number else ScriptError(words[:1000])


def complete_programs(text: str) -> tuple[list[str], str]:
    """Cut text that has arrived on a script port into whole programs.

    A ``def`` whose name a later line of the same text calls is one program with that line.

    Returns:
        the programs (from ``def`` or ``sec`` to its ``end``, or one line by itself), and
        the rest, which is not complete yet.
    """
    programs: list[str] = []
    defined: set[str] = set()
    library = start = position = depth = 0
    while (stop := text.find("\n", position)) >= 0:
        line = _QUOTED_TEXT_AND_COMMENT.sub("", text[position:stop]).strip()
        marked = line.startswith("$")
        position = stop + 1
        if line and not marked:
            depth = max(0, depth + len(_BLOCK_START.findall(line)) - len(_BLOCK_END.findall(line)))
        if depth == 0:
            block = text[start:position]
            if line and not marked:
                if match := _DEFINED_NAME.match(block):
                    library = library if defined else len(programs)
                    defined.add(match[1])
                called = defined and not match and not defined.isdisjoint(_CALLED_NAME.findall(block))
                first = library if called else len(programs)
                programs[first:] = ["".join([*programs[first:], block])]
            start = position
    return programs, text[start:]


def translate(text: str, builtins: Mapping[str, bool], names: Names | None = None) -> Translation:
    """Turn one program into a Python module.

    Args:
        text: from ``def name():`` or ``sec name():`` to ``end``, or statements by themselves.
        builtins: names of the controller's functions -> whether they take time, and are therefore generators.
        names: those of the program that these statements become a part of; none for a program of its own.

    Raises:
        ScriptError: the text is not URScript as this module describes it; the message gives the line.
    """
    if len(text) > MAX_LENGTH:
        raise ScriptError(f"a program has at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        return _Translator(text, builtins, names).translation()
    except ScriptError:
        raise
    except Exception as exc:  # of Python's own compiler, whose limits are not ours: too deep, too many, misplaced
        raise ScriptError(f"the program cannot be translated: {type(exc).__name__}: {exc}") from exc


_MAX_BLOCKS = 20  # of blocks inside each other
_MAX_FUNCTIONS = 1000  # of one program
_FUNCTION_KINDS = ("def", "sec", "thread")
_BLOCK_KINDS = (*_FUNCTION_KINDS, "if", "while", "switch")
_GIVE_WAY = "if _spent(): yield"  # in each call and each turn of a loop
#: statement of one word -> its Python
_SINGLE_WORDS = {
    **{"break": "break", "continue": "continue", "pass": "pass", "halt": "_halt()", "pause": "yield _pause()"},
    **{"enter_critical": "pass", "exit_critical": "pass"},
}
#: statement of a word and an expression -> its Python
_WORD_OPERATIONS = {"kill": "_kill({})", "join": "yield from _join({})", "assert": "_assert({})"}


@dataclass(slots=True)
class _Function:
    """Function that is being translated: its Python lines, and what it does with variables."""

    kind: str
    name: str
    python_name: str
    outer: frozenset[str] = frozenset()  # what the program's own body assigns before it
    parameters: list[str] = field(default_factory=list)
    body: list[tuple[str, int]] = field(default_factory=list)  # Python, and the line it is from
    assigned: set[str] = field(default_factory=set)
    changed: set[str] = field(default_factory=set)  # in an element, a member or by a method
    local: set[str] = field(default_factory=set)
    loops: int = 0


class _Translator(ExpressionParser):
    """Translator of one text."""

    def __init__(self, text: str, builtins: Mapping[str, bool], names: Names | None) -> None:
        self._known = Names() if names is None else names
        super().__init__(text, set(), builtins)
        pairs = list(pairwise(self._tokens))
        defined = [name.text for word, name in pairs if word.text in _FUNCTION_KINDS and name.kind == "name"]
        if len(defined) > _MAX_FUNCTIONS:
            raise ScriptError(f"a program has at most {_MAX_FUNCTIONS} functions, got {len(defined)}")
        self._functions = self._known.functions | set(defined)
        self._globals = {name.text for word, name in pairs if word.text == "global" and name.kind == "name"}
        self._globals |= self._known.shared
        self._defined: set[str] = set()
        self._open: list[_Function] = []
        self._module: list[tuple[str, int]] = []
        self._indent = 0
        self._interpreted = names is not None

    def translation(self) -> Translation:
        if self._is_one_function():
            main = self._function()
            self._module.append((f"main = f_{main.name}", 0))
        else:
            main = self._statements()
        code = marshal.dumps(compile("\n".join(line for line, _ in self._module), f"<{main.name}>", "exec"))
        names = Names(frozenset(self._defined | self._known.functions), frozenset(self._globals | main.assigned))
        return Translation(
            main.name, main.kind == "sec", code, self._text, tuple(number for _, number in self._module), names
        )

    def _is_one_function(self) -> bool:
        """Return whether the text is one def or sec, and nothing else."""
        if self._token.text not in ("def", "sec") or self._interpreted:
            return False
        depth = 0
        for number, token in enumerate(self._tokens):
            depth += (token.kind == "name" and token.text in _BLOCK_KINDS) - (token.text == "end")
            if depth == 0:
                return self._tokens[number + 1].kind == "end"
        return True  # it has no end, which is said where it is parsed

    def _statements(self) -> _Function:
        """Translate statements by themselves as a program."""
        first = self._tokens[1].text if self._token.text in _FUNCTION_KINDS else "unnamed"
        self._open.append(main := _Function("def", first, "main"))
        while self._token.kind != "end":
            self._statement()
        self._finish()
        return main

    # functions

    def _function(self) -> _Function:
        kind, name = self._take().text, self._name()
        made = _Function(kind, name, f"f_{name}")
        if made.name in self._defined:
            raise self._fail(f"the function {made.name} is defined twice")
        self._defined.add(made.name)
        if self._open:
            made.outer = frozenset(self._open[0].assigned)
        indent, self._indent = self._indent, 0
        self._open.append(made)
        self._take("(")
        self._inside(self._parameters)
        self._take(":")
        self._indent = -1
        self._block("end")
        self._take("end")
        self._finish()
        self._indent = indent
        return made

    def _parameters(self) -> str:
        here = self._open[-1]
        while not self._next_is(")"):
            name = self._name()
            if name in here.parameters or len(here.parameters) >= 200:
                raise self._fail(f"the parameter {name} is there twice, or there are more than 200")
            here.parameters.append(name)
            if self._next_is("="):
                self._take()
                self._write(f"if v_{name} is _absent: v_{name} = {self.expression()}")
            else:
                self._write(f"_assert(v_{name} is not _absent, 'the parameter {name} has no value')")
            if not self._next_is(")"):
                self._take(",")
        return self._take(")").text

    def _finish(self) -> None:
        """Write the Python of a function that is parsed to its end."""
        made = self._open.pop()
        is_main = not self._open
        shared = self._globals | made.assigned if is_main else (self._globals | made.outer) - made.local
        held = (made.assigned & shared | made.changed - made.assigned) - made.local - set(made.parameters)
        defaults = ", ".join(f"v_{name}=_absent" for name in made.parameters)
        head = [f"def {made.python_name}({defaults}):"]
        if held:
            head.append("  global " + ", ".join(f"v_{name}" for name in sorted(held)))
        head += [f"  {_GIVE_WAY}", "  if False: yield"]
        self._module += [(line, made.body[0][1] if made.body else 0) for line in head]
        self._module += [(f"  {line}", number) for line, number in made.body]

    # statements

    def _write(self, line: str, number: int = 0) -> None:
        self._open[-1].body.append((" " * self._indent + line, number or self._tokens[self._at - 1].line))

    def _changed(self, name: str) -> None:
        self._open[-1].changed.add(name)

    def _block(self, *ends: str) -> None:
        """Translate statements up to one of some words."""
        self._indent += 1
        if self._indent > _MAX_BLOCKS:
            raise self._fail(f"more than {_MAX_BLOCKS} blocks inside each other")
        while not (self._token.kind == "name" and self._token.text in ends):
            if self._token.kind == "end":
                raise self._fail("a block has no 'end'", before=True)
            self._statement()
        self._write("pass")
        self._indent -= 1

    def _statement(self) -> None:
        kind, word, number, _ = self._token
        if kind != "name":
            raise self._fail(f"{word!r} is unexpected")
        if word in ("def", "thread", "sec") and self._tokens[self._at + 1].kind == "name":
            self._function()
        elif word == "if":
            self._if()
        elif word == "while":
            self._take()
            self._write(f"while {self._condition()}:", number)
            self._open[-1].loops += 1
            self._indent += 1
            self._write(_GIVE_WAY)
            self._indent -= 1
            self._block("end")
            self._open[-1].loops -= 1
            self._take("end")
        elif word == "switch":
            self._switch()
        elif word in _SINGLE_WORDS:
            if word in ("break", "continue") and not self._open[-1].loops:
                raise self._fail(f"{word} stands outside of a loop")
            self._take()
            self._write(_SINGLE_WORDS[word])
        elif word == "return":
            self._take()
            after = self._token
            bare = after.first or after.text in ("end", "elif", "else", "case", "default")
            self._write("return" if bare else f"return {self.expression()}", number)
        elif word in _WORD_OPERATIONS:
            self._take()
            self._write(_WORD_OPERATIONS[word].format(self.expression()), number)
        else:
            self._assignment_or_call()

    def _condition(self) -> str:
        made = self.expression()
        self._take(":")
        return made

    def _if(self) -> None:
        number = self._take().line
        self._write(f"if {self._condition()}:", number)
        self._block("elif", "else", "end")
        while self._token.text == "elif":
            number = self._take().line
            self._write(f"elif {self._condition()}:", number)
            self._block("elif", "else", "end")
        self._last_block("else", "else:")

    def _switch(self) -> None:
        self._take()
        variable = f"_switch_{self._indent}"
        self._write(f"{variable} = {self._condition()}")
        word = "if"
        while self._token.text == "case":
            number = self._take().line
            self._write(f"{word} {variable} == {self._condition()}:", number)
            self._block("case", "default", "end")
            word = "elif"
        self._last_block("default", "else:" if word == "elif" else "if True:")

    def _last_block(self, word: str, head: str) -> None:
        """Translate the block for all that is left, where there is one, and the end."""
        if self._token.text == word:
            self._take()
            self._take(":")
            self._write(head)
            self._block("end")
        self._take("end")

    def _assignment_or_call(self) -> None:
        here, begin, number = self._open[-1], self._at, self._token.line
        scope = self._take().text if self._token.text in ("global", "local") else ""
        name = self._name()
        keys = ""
        while self._next_is("[", "."):
            if self._take().text == "[":
                keys += self._inside(self._keys)
            elif self._tokens[self._at + 1].text == "(":
                break
            else:
                keys += f"{self._name()!r}, "
        if not (self._token.text == "=" and self._token.kind == "sign"):
            if scope:
                raise self._fail(f"expected '=' after {scope} {name}", before=self._token.first)
            self._at = begin
            self._write(self.expression(), number)
            return
        self._take()
        value = self.expression()
        if scope == "local":
            here.local.add(name)
        if keys:
            here.changed.add(name)
            self._write(f"v_{name} = _with({value}, ({keys}), v_{name})", number)
        else:
            here.assigned.add(name)
            self._write(f"v_{name} = {value}", number)


_MAX_LINE_LENGTH = 4000  # characters of a line: it is translated within a control cycle
_MAX_STATEMENTS = 2000  # in one interpreter mode; then it has to be cleared


class Interpreter:
    """Interpreter of one program.

    Args:
        space: the program's names, with what they stand for.
        names: what the program defines.
        builtins: names of the controller's functions -> whether they take time.

    Attributes:
        queue: statements that wait, with their numbers.
        active: True in interpreter mode; False ends it once the present statement is done.
        executed: number of the last statement that has begun; 0 before the first.
        interpreted: number of the last one that was taken.
        cleared: number of the last one that was cleared.
        aborts: True from a command to abort the present motion until that has been done.
    """

    def __init__(self, space: dict[str, Any], names: Names, builtins: Mapping[str, bool]) -> None:
        self._space, self._of_program, self._names = space, names, names
        self._builtins = builtins
        self.queue: deque[tuple[int, Translation]] = deque()
        self.active = False
        self.executed = self.interpreted = self.cleared = 0
        self.aborts = False

    def take(self, line: str) -> int:
        """Take a line of statements, and return its number.

        Raises:
            ScriptError: it is not URScript, or there are too many already.
        """
        if len(line) > _MAX_LINE_LENGTH or self.interpreted - self.cleared >= _MAX_STATEMENTS:
            raise ScriptError(
                f"a line has at most {_MAX_LINE_LENGTH} characters, and one interpreter mode {_MAX_STATEMENTS} lines; "
                "clear_interpreter() makes room"
            )
        made = translate(line, self._builtins, self._names)
        self._names = Names(made.names.functions, self._names.shared)
        self.interpreted += 1
        self.queue.append((self.interpreted, made))
        return self.interpreted

    def clear(self) -> None:
        """Forget the functions that statements have defined."""
        self.cleared = self.executed
        self._names = self._of_program

    def run(self, clear_queue: bool, clear_on_end: bool) -> Generator[None, None, None]:
        """Execute what comes, until a statement or a thread ends it.

        Raises:
            ScriptError: a statement has failed.
        """
        if self.active:
            raise ScriptError("interpreter_mode() must not be called within interpreter mode")
        if clear_queue:
            self.queue.clear()
        self.active = True
        while self.active:
            if not self.queue:
                yield
                continue
            self.executed, made = self.queue.popleft()
            exec(marshal.loads(made.code), self._space)
            try:
                yield from self._space["main"]()
            except (ScriptError, ArithmeticError, LookupError, TypeError, ValueError, NameError) as exc:
                raise made.located(exc) from exc
        if clear_on_end:
            self.clear()
