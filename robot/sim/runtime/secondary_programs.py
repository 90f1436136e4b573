"""Secondary programs of the simulated controller: ``sec`` programs, which run beside the main one."""

from __future__ import annotations

from coneskin.robot.sim.functions.script_host import ScriptHost
from coneskin.robot.sim.machine.notices import ProgramFailed, ProgramNotice
from coneskin.robot.sim.urscript.translator import Translation
from coneskin.robot.sim.urscript.values import ScriptError

from .program import Program

__all__ = ["MAX_SECONDARY", "SecondaryPrograms"]

MAX_SECONDARY = 20  #: that run at once


class SecondaryPrograms:
    """Secondary programs of one controller."""

    def __init__(self, host: ScriptHost) -> None:
        self._host = host
        self._running: list[Program] = []

    def __len__(self) -> int:
        return len(self._running)

    def start(self, translation: Translation) -> None:
        """Start one, unless too many run already."""
        if len(self._running) >= MAX_SECONDARY:
            reason = f"{MAX_SECONDARY} sec programs run already"
            self._host.log("refused", program=translation.name, reason=reason)
            self._host.tell(ProgramFailed(f"{translation.name} does not start: {reason}"))
            return
        self._running.append(Program(self._host, translation))
        self._host.tell(ProgramNotice(translation.name, "STARTED"))

    def turn(self) -> None:
        """Run each for one control cycle, and forget those that have ended."""
        for program in list(self._running):
            try:
                program.turn()
            except ScriptError as exc:
                self._host.fail(program.name, exc)
            if not program.running:
                self._running.remove(program)
                program.close()
                self._host.tell(ProgramNotice(program.name, "STOPPED"))
