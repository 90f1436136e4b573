"""Translator from URScript to Python, with which the simulated controller runs the program that ur_rtde uploads.

A program becomes a Python module whose blocking functions are generators: each ``yield`` ends the thread's turn in the
2 ms control cycle. So the quirks of a program are those of its own text; nothing in this module knows ur_rtde.

Understood: def, sec, thread, if/elif/else, while, break, continue, return, halt, global, local, assignment (also to an
element), run, kill, join, pause, enter_critical, exit_critical, lists, poses, parameters with a default, named
arguments, arithmetic and logic. Not understood: struct, switch, interpreter mode. A name assigned in a function is
local to it if it says so, or if no variable of that name is declared global anywhere or assigned in the program's own
body before the function. A critical section ends no turn and holds nobody up: a thread gives way only where it waits,
and the program of Universal Robots' own driver waits for its socket in one while another of its threads moves the arm.

Source: Universal Robots, "The URScript Programming Language", chapters 1-2 (language, scoping rules) and 3 (threads).
"""

from __future__ import annotations

import re
from collections.abc import Set
from dataclasses import dataclass
from types import CodeType
from typing import Any

from .syntax import Function, Parser, numbered_lines
from .values import ScriptError

_BY_SUBJECT = {
    "field buses": """modbus_add_rw_signal modbus_add_signal modbus_delete_signal modbus_get_error
        modbus_get_signal_status modbus_get_time_since_signal_invalid modbus_reset_connection
        modbus_send_custom_command modbus_set_digital_input_action modbus_set_output_register modbus_set_output_signal
        modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency modbus_set_signal_watchdog
        read_port_bit read_port_register write_port_bit write_port_register get_euromap_input get_euromap_output
        set_euromap_output set_euromap_runstate_dependent_choice get_rtde_value rpc_factory
        request_boolean_from_primary_client request_float_from_primary_client request_integer_from_primary_client
        request_string_from_primary_client""",
    "outputs that follow the state of a program": """set_runstate_configurable_digital_output_to_value
        set_runstate_gp_boolean_output_to_value set_runstate_standard_analog_output_to_value
        set_runstate_standard_digital_output_to_value set_runstate_tool_digital_output_to_value""",
    "conveyors": """conveyor_pulse_decode encoder_enable_pulse_decode encoder_enable_set_tick_count
        encoder_get_tick_count encoder_set_tick_count encoder_unwind_delta_tick_count get_conveyor_tick_count
        set_conveyor_tick_count stop_conveyor_tracking track_conveyor_circular track_conveyor_linear""",
    "offsets of paths": """path_offset_disable path_offset_enable path_offset_get path_offset_set
        path_offset_set_alpha_filter path_offset_set_max_offset""",
    "motion that this arm has not": """jerk_gain_scaling_get jerk_gain_scaling_set motion_version_get
        motion_version_set pause_on_error_code position_deviation_warning reset_revolution_counter
        tool_wrench_limit_disable tool_wrench_limit_set screw_driving end_screw_driving""",
    "the rest": """estimate_payload get_base_acceleration set_base_acceleration high_holding_torque_disable
        high_holding_torque_enable powerdown set_baselight_iec set_baselight_off set_baselight_solid time""",
}

#: name of each function -> its subject
_NOT_SIMULATED: dict[str, str] = {name: subject for subject, names in _BY_SUBJECT.items() for name in names.split()}


MAX_LENGTH = 256_000  #: characters of a program; that of ur_rtde has 50 000
#: first word of a line that an ``end`` must close
_BLOCK_START = re.compile(r"(?:def|sec|thread|if|while)\b")


@dataclass(frozen=True, slots=True)
class Translation:
    """Program that is ready to run.

    Attributes:
        name: name in the program's text.
        secondary: True for a ``sec`` program, which runs beside the main one and cannot move the arm.
        code: Python module that defines ``main``, a generator function, and the threads and functions it uses.
    """

    name: str
    secondary: bool
    code: CodeType


def complete_programs(text: str) -> tuple[list[str], str]:
    """Cut text that has arrived on a script port into whole programs.

    Returns:
        the programs (from ``def`` or ``sec`` to its ``end``, or one line by itself), and
        the rest, which is not complete yet.
    """
    programs, start, position, depth = [], 0, 0, 0
    while (stop := text.find("\n", position)) >= 0:
        line = text[position:stop].strip()
        position = stop + 1
        if _BLOCK_START.match(line):
            depth += 1
        elif line == "end" or line.startswith(("end ", "end#", "end\t")):
            depth = max(0, depth - 1)
        if depth == 0:
            if (block := text[start:position]).strip() and not line.startswith(("#", "$")):
                programs.append(block)
            start = position
    return programs, text[start:]


def translate(text: str, builtins: Set[str], blocking: Set[str]) -> Translation:
    """Turn one program into a Python module.

    Args:
        text: from ``def name():`` or ``sec name():`` to ``end``, or a single line.
        builtins: names of the controller's functions.
        blocking: those of them that take time, and are therefore generators.

    Raises:
        ScriptError: the text is not URScript as this module describes it; the message gives the line.
    """
    if len(text) > MAX_LENGTH:
        raise ScriptError(f"a program has at most {MAX_LENGTH} characters, got {len(text)}")
    lines = numbered_lines(text)
    if not lines or not re.match(r"(def|sec)\b", lines[0][1]):
        lines = [(0, "def unnamed():"), *lines, (0, "end")]
    try:
        parser = Parser(lines)
        program = parser.program()
        source = _Writer(program, parser, builtins, blocking, text).module()
        return Translation(program.name, program.kind == "sec", compile(source, f"<{program.name}>", "exec"))
    except ScriptError:
        raise
    except Exception as exc:  # of Python's own compiler, whose limits are not ours: too deep, too many, misplaced
        raise ScriptError(f"the program cannot be translated: {type(exc).__name__}: {exc}") from exc


#: kind of a statement -> its Python, with the place of its expression; any other is the same in Python
_STATEMENT_FORMS = {
    **{"call": "{}", "return": "return {}", "kill": "_kill({})", "join": "yield from _join({})", "halt": "_halt()"},
    **{"pause": "yield _pause()", "enter_critical": "pass", "exit_critical": "pass"},
}


class _Writer:
    """Writer of Python source from the tree of a program."""

    def __init__(self, program: Function, parser: Parser, builtins: Set[str], blocking: Set[str], text: str) -> None:
        self.program = program
        self.functions = parser.functions
        self.globals = parser.globals
        for made in self.functions.values():
            unknown = made.calls.keys() - builtins - self.functions.keys()
            if unknown:
                raise _unknown_function(made, unknown, text)
        self.blocking = set(blocking)
        self._spread_blocking()

    def _spread_blocking(self) -> None:
        """Mark functions that call one that blocks, or that join a thread or pause, as blocking too."""
        for made in self.functions.values():
            if _contains(made.body, "join") or _contains(made.body, "pause"):
                self.blocking.add(made.name)
        grew = True
        while grew:
            grew = False
            for made in self.functions.values():
                if made.name not in self.blocking and made.calls.keys() & self.blocking:
                    self.blocking.add(made.name)
                    grew = True

    def module(self) -> str:
        lines: list[str] = []
        shared = self.globals | self.program.assigned
        for made in self.functions.values():
            is_main = made is self.program
            parameters = ", ".join(f"v_{name}={'_absent' if made.parameters[name] else 0}" for name in made.parameters)
            lines.append(f"def {'main' if is_main else 'f_' + made.name}({parameters}):")
            seen = shared if is_main else (self.globals | made.outer) - made.local
            held = (made.assigned | made.elements) & seen - made.parameters.keys()
            if held:
                lines.append("    global " + ", ".join(f"v_{name}" for name in sorted(held)))
            lines.append("    _count_step()")
            for name, value in made.parameters.items():
                if value:
                    lines.append(f"    if v_{name} is _absent: v_{name} = {self.text(value)}")
            lines += [f"    v_{n} = _copy(v_{n})" for n in made.parameters if n in made.elements]
            self.statements(made.body, lines, "    ")
            if is_main or made.kind == "thread" or made.name in self.blocking:
                lines.append("    if False: yield")
            lines.append("    return None")
        return "\n".join(lines)

    def statements(self, body: list[tuple[Any, ...]], lines: list[str], indent: str) -> None:
        for kind, _, *parts in body:
            if kind == "if":
                branches, otherwise = parts
                word = "if"
                for test, inner in branches:
                    lines.append(f"{indent}{word} {self.text(test)}:")
                    self.statements(inner, lines, indent + "    ")
                    lines.append(f"{indent}    pass")
                    word = "elif"
                if otherwise:
                    lines.append(f"{indent}else:")
                    self.statements(otherwise, lines, indent + "    ")
            elif kind == "while":
                test, inner = parts
                lines += [f"{indent}while {self.text(test)}:", f"{indent}    _count_step()"]
                self.statements(inner, lines, indent + "    ")
            elif kind == "set":
                name, value = parts
                made = self.text(value)
                lines.append(f"{indent}v_{name} = " + (f"_copy({made})" if made.startswith("v_") else made))
            elif kind == "element":
                name, key, value = parts
                lines.append(f"{indent}_set(v_{name}, {self.text(key)}, {self.text(value)})")
            else:  # of one expression, or of none
                lines.append(indent + _STATEMENT_FORMS.get(kind, kind).format(*map(self.text, parts)))

    def text(self, made: object) -> str:
        """Return an expression with its calls filled in: ``yield from`` for generators, and name prefixes."""
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


def _unknown_function(made: Function, unknown: Set[str], text: str) -> ScriptError:
    """Return the error of the first call of a function that does not exist."""
    name = min(unknown, key=lambda name: (made.calls[name], name))
    number, lines = made.calls[name], text.splitlines()
    column = lines[number - 1].find(name) + 1 if 0 < number <= len(lines) else 0
    known = sorted(unknown & _NOT_SIMULATED.keys())
    here = f"; {', '.join(known)}: URScript, but not simulated" if known else ""
    return ScriptError(
        f"{made.name}: the controller has no function {', '.join(sorted(unknown))}{here}",
        title=f"compile_error_name_not_found:{name}:",
        line=number,
        column=column,
    )


def _contains(body: object, kind: str) -> bool:
    if isinstance(body, tuple) and body and body[0] == kind:
        return True
    return isinstance(body, list | tuple) and any(_contains(part, kind) for part in body)
