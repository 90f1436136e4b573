"""Plant: what the controller's joint targets move, and what its sensors then measure.

The controller makes targets, the plant follows them as well as it can. The one here follows them exactly; another one
may have masses, servos that give way, and things to run into (``coneskin.impact.simulation``).
This package knows none of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from coneskin.robot.arm.models import JOINT_COUNT

_NO_CURRENT = (0.0,) * JOINT_COUNT


class PlantLost(Exception):
    """The plant is gone, or too far behind: nothing that it measures counts any more. The message says which."""


class PlantState(NamedTuple):
    """What the controller measures in one cycle."""

    q: Sequence[float]  #: joint positions [rad]
    qd: Sequence[float]  #: joint speeds [rad/s]
    current: Sequence[float]  #: of each motor beyond what the controller's model of the arm expects [A]


class Plant(Protocol):
    """Plant of one arm. It stands at the controller's start position until the first cycle."""

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Let one control cycle pass, and return what is measured.

        Args:
            q: targets of the joints at its end [rad].
            qd: their speeds then [rad/s].

        Raises:
            PlantLost: the plant is gone, or too far behind; it is not asked again.
        """

    def close(self) -> None:
        """Let the plant go; may be called again."""


class KinematicPlant:
    """Plant without dynamics: it does what is commanded, so measured and commanded motion are the same."""

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Return the targets; see `Plant`."""
        return PlantState(q, qd, _NO_CURRENT)

    def close(self) -> None:
        """Do nothing: there is nothing to let go."""
