"""Controller with its user interface, without sockets: what a test of PolyScope's clients needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.ports.dashboard import Dashboard
from coneskin.robot.sim.ports.user_interface import EXTERNAL_CONTROL, UserInterface
from coneskin.robot.sim.urscript.translator import Translation, translate

WAIT = "def wait():\n  while True:\n    sleep(0.01)\n  end\nend\n"
EXTERNAL = f"def external_control():\n  {EXTERNAL_CONTROL}\nend\n"


def save_program(folder: Path, name: str, script: str) -> None:
    """Write a ``.urp`` file as PolyScope does, with its script beside it."""
    (folder / f"{name}.urp").write_bytes(b"")
    (folder / f"{name}.script").write_text(script)


class Console:
    """Controller, its user interface and one client of its dashboard."""

    def __init__(self, programs: Path | None = None, **options: Any) -> None:
        self.controller = Controller(Options(programs=programs, **options))
        self.interface = UserInterface(self.controller, self.run, self.translate)
        self.dashboard = Dashboard(self.interface)

    def translate(self, text: str) -> Translation:
        return translate(text, Builtins.functions())

    def run(self, text: str) -> None:
        self.controller.program_arrived()
        self.controller.load(self.translate(text))

    def step(self, cycles: int) -> None:
        for _ in range(cycles):
            self.interface.turn()
            self.controller.update()

    def say(self, line: str) -> str:
        return self.dashboard.answer(line)
