"""Script port of the simulated controller: what a client of ports 30001 to 30003 sends, cut into programs and commands.

Beside URScript these ports take the lines below, which Universal Robots does not document but whose own client library
sends; they act at once and do not touch a running program otherwise.
"""

from __future__ import annotations

from collections.abc import Callable

from coneskin.robot.sim.machine.notices import ProgramFailed
from coneskin.robot.sim.runtime.controller import Controller
from coneskin.robot.sim.runtime.power import power
from coneskin.robot.sim.urscript.translator import MAX_LENGTH, complete_programs

from .client_messages import encode_notice

__all__ = ["ScriptPort"]

#: line of a client -> what the controller does
_COMMANDS: dict[str, Callable[[Controller], object]] = {
    "power on": lambda c: power(c, "power on"),
    "power off": lambda c: power(c, "power off"),
    "set robotmode run": lambda c: power(c, "brake release"),
    "set unlock protective stop": lambda c: c.unlock(early=True),  # only the dashboard makes one wait
    "stop program": lambda c: c.stop_program("stop program"),
    "pause program": lambda c: c.pause_program(),
    "resume program": lambda c: c.resume_program(),
}


class ScriptPort:
    """Text of one client: bytes in; whole programs go to ``run``.

    Args:
        controller: takes the commands.
        run: takes the text of a program.
        messages: whether the client reads messages: on the primary interface alone.

    Attributes:
        left: its connection has to end: what comes is no program.
    """

    def __init__(self, controller: Controller, run: Callable[[str], None], *, messages: bool = False) -> None:
        self._controller, self._run, self._messages = controller, run, messages
        self._rest = ""
        self.left = False

    def __call__(self, data: bytes) -> bytes:
        """Take bytes; nothing is answered, but to a program that is too long."""
        programs, self._rest = complete_programs(self._rest + data.decode("utf-8", "replace"))
        if len(self._rest) > MAX_LENGTH:
            self._rest, self.left = "", True
            problem = f"a program has at most {MAX_LENGTH} characters"
            self._controller.log("dropped", reason=problem)
            return encode_notice(self._controller.timestamp, ProgramFailed(problem)) if self._messages else b""
        last = True  # of two that move the arm in one batch the first would never start
        kept = []
        for text in reversed(programs):
            if text.strip() in _COMMANDS or text.lstrip().startswith("sec "):
                kept.append(text)
            elif last:
                kept.append(text)
                last = False
        for text in reversed(kept):
            command = _COMMANDS.get(text.strip())
            if command is None:
                self._run(text)
            else:
                self._controller.log("command", line=text.strip())
                command(self._controller)
        return b""
