"""What moves the arm away once it stands after a touch. Built only where a reaction of the scene may move it."""

from __future__ import annotations

from collections.abc import Sequence

from .commands import ArmState, ContactOnLink, Reaction
from .follower import FollowerProgram
from .leaving import Leaving
from .movement import choose_movement
from .outputs import Outputs
from .space import Space
from .table import Table
from .trail import Trail
from .ur_models import ArmModel, Joints

__all__ = ["Mover"]


class Mover:
    """Knows where the arm has been, and begins the movement that a reaction wants.

    Args:
        model: the arm.
        watchdog_hz: of the program that follows in the controller; None where the owner of ur_rtde moves the arm.
        table: what the arm must not go below while it moves.
    """

    def __init__(self, model: ArmModel, watchdog_hz: float | None = None, table: Table | None = None) -> None:
        self._model = model
        self._watchdog_hz = watchdog_hz
        self._token = 0
        self._space = Space(model, table)
        self._trail = Trail()

    def note(self, time: float, q: Joints) -> None:
        """Take measured joint positions [rad] of a time [s]."""
        self._trail.note(time, q)

    def begin(
        self,
        reaction: Reaction,
        at_touch: ArmState,
        here: ArmState,
        contacts: Sequence[ContactOnLink],
        out: Outputs,
    ) -> Leaving | str:
        """Begin to move away; or why that cannot be.

        Args:
            reaction: its kind is "retreat" or "comply".
            at_touch: the arm when the touch was seen.
            here: the arm now, standing.
            contacts: the touches, as they were last seen.
            out: takes what comes of it.
        """
        movement = choose_movement(self._model, reaction, at_touch, here, contacts, self._trail, self._space)
        if isinstance(movement, str):
            return movement
        program = None
        if self._watchdog_hz is not None:
            self._token += 1
            program = FollowerProgram(self._token, reaction.deceleration, self._watchdog_hz)
        return Leaving(movement, here.time, program, out)
