"""Moves an arm that another program moves otherwise: a program of ours in the controller that follows joint speeds.

The speeds come from the guard in each second control cycle, through input registers (``steering.py``). Each movement
has a token of its own: the program ends where the register holds another one, so that speeds which are left from before
move nothing. Where the guard falls silent, the controller's own watchdog ends the program, and the arm brakes. Pure.
Source: UR script manual, read_input_float_register, rtde_set_watchdog, speedj.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .ur_models import Joints

__all__ = ["REGISTERS", "FollowerProgram", "Steer"]

# of the half of the registers that is for clients of RTDE; ur_rtde uses the other half, unless it is told not to
_SPEEDS = range(40, 46)
_ACCELERATION = 46
_TOKEN = 47
#: the controller's names of the registers, in the order of ``Steer.values``
REGISTERS = (
    f"input_int_register_{_TOKEN}",
    *(f"input_double_register_{number}" for number in (*_SPEEDS, _ACCELERATION)),
)


class Steer(NamedTuple):
    """Speeds for the program with this token.

    Attributes:
        token: of the movement; 0 is nobody's.
        qd: joint speeds [rad/s].
        acceleration: of the leading joint [rad/s2].
    """

    token: int
    qd: Joints
    acceleration: float

    @property
    def values(self) -> tuple[int | float, ...]:
        """What to write to ``REGISTERS``."""
        return (self.token, *self.qd, self.acceleration)


class FollowerProgram(NamedTuple):
    """The program, to be sent after the first ``Steer``.

    Attributes:
        token: of the movement, above 0.
        deceleration: of the leading joint at the end [rad/s2].
        watchdog_hz: speeds that come less often than this end the program.
    """

    token: int
    deceleration: float
    watchdog_hz: float

    @property
    def text(self) -> str:
        """URScript."""
        speeds = ", ".join(f"read_input_float_register({number})" for number in _SPEEDS)
        return (
            "def coneskin_follow():\n"
            f'  rtde_set_watchdog("{REGISTERS[0]}", {self.watchdog_hz:g}, "stop")\n'
            f"  while read_input_integer_register({_TOKEN}) == {self.token}:\n"
            f"    speedj([{speeds}], read_input_float_register({_ACCELERATION}), 0.002)\n"
            "  end\n"
            f"  stopj({self.deceleration:.3f})\n"
            "end\n"
        )
