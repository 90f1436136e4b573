"""Simulated controller without sockets: programs go in, and its cycles run as fast as they can."""

from __future__ import annotations

import io
import json
from typing import Any

from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.ports.dashboard import Dashboard
from coneskin.robot.sim.ports.user_interface import UserInterface
from coneskin.robot.sim.urscript.translator import translate

FAR = "[1.5, -1.5708, 1.5708, -1.5708, -1.5708, 0]"


class Bench:
    """A controller, its log, and what a test does with it."""

    def __init__(self, **options: Any) -> None:
        self.text = io.StringIO()
        self.controller = Controller(Options(**options), self.text)
        self.dashboard = Dashboard(UserInterface(self.controller, self.send)).answer

    def send(self, text: str) -> None:
        made = translate(text, Builtins.functions())
        if not made.secondary:
            self.controller.program_arrived()
        self.controller.load(made)

    def step(self, cycles: int) -> None:
        for _ in range(cycles):
            self.controller.update()

    def events(self, kind: str) -> list[dict[str, Any]]:
        lines = [json.loads(line) for line in self.text.getvalue().splitlines()]
        return [line for line in lines if line["event"] == kind]
