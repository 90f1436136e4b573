"""Torque from outside on the joints, as the motor currents show it, and what of it no touch explains. Pure.

    symbol    meaning
    t         torque from outside [N m]: k (i_expected - i_measured), less what it was while nothing touched
    g_c       torque of a push of 1 N on touch c: J^T (-n)
    F_c       force of touch c [N]
    r         t - sum F_c g_c, with the F_c >= 0 that leave the least of it

What the controller expects contains inertia and payload. What is left while nothing touches is friction, and what the
payload was set wrong by: it is learned until the touch. The whole arm is a sensor in this way, where no skin is too.
A body behind that pushes against a touch takes that touch's force away, so that its own shows in r once it is greater.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from coneskin.robot.arm.kinematics import place_point
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.vectors import dot
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.reaction.types import ContactOnLink

_SPREADS: Final = 3.0  # of what was learned, that count as nothing
_LEARNING_TIME: Final = 500.0  # states, 1 s
_RESISTED_SAMPLES: Final = 3  # in a row, 6 ms; a single one may be noise
_FIT_ROUNDS: Final = 3  # over the touches; they are few, and seldom alike


class OutsideTorque:
    """Torque from outside on the joints of one arm.

    Attributes:
        now: by the newest state [N m]. None where the controller sends no currents, or it is not known what they say.
        spread: largest of each joint lately, while nothing touched [N m].
    """

    def __init__(self, model: ArmModel) -> None:
        self.now: Joints | None = None
        self._currents = model.currents
        self._usual: Joints | None = None
        self.spread: Joints = (0.0,) * model.joints

    def feed(self, state: ControllerState, untouched: bool) -> None:
        """Take a measured state. While nothing touches and the arm is free, what it shows is learned."""
        currents = self._currents
        if currents is None or state.current is None or state.target_current is None:
            self.now = None
            return
        both = zip(currents.torque_per_ampere, state.target_current, state.current, strict=True)
        raw = tuple([k * (expected - measured) for k, expected, measured in both])
        if self._usual is None:
            self._usual = raw
        usual = self._usual
        off = self.now = tuple([a - b for a, b in zip(raw, usual, strict=True)])
        if untouched:
            self._usual = tuple([a + b / _LEARNING_TIME for a, b in zip(usual, off, strict=True)])
            kept = 1.0 - 1.0 / _LEARNING_TIME
            self.spread = tuple([max(abs(a), kept * b) for a, b in zip(off, self.spread, strict=True)])

    @property
    def tolerance(self) -> Joints:
        """Torque of each joint that counts as nothing [N m]."""
        if (currents := self._currents) is None:
            return self.spread
        rows = zip(currents.min_unexplained, currents.max_unexplained, self.spread, strict=True)
        return tuple([min(most, least + _SPREADS * spread) for least, most, spread in rows])


class ResistanceMonitor:
    """Monitor of one motion of ours: does something resist it, on the skin or beside it?

    Args:
        yields: True where the motion gives way to a push, which may grow. Else no push may be more than at its start.
        tolerance: torque of each joint that counts as nothing [N m]. None for what was learned.
    """

    def __init__(self, model: ArmModel, torque: OutsideTorque, yields: bool, tolerance: Joints | None = None) -> None:
        self._model = model
        self._torque = torque
        self._yields = yields
        self._tolerance = tolerance or torque.tolerance
        self._pushes: dict[int, ContactOnLink] = {}  # touch -> with the newest certain place
        self._most: dict[int, float] = {}  # touch -> largest force [N]
        self._least: Joints | None = None
        self._beyond = 0  # samples in a row

    def resistance(self, q: Joints, contacts: Sequence[ContactOnLink]) -> str:
        """Take measured joint positions [rad] and the touches. Return why the motion must end; empty: it need not."""
        torque = self._torque.now
        if torque is None:
            return "the controller sends no motor currents: nothing shows what the arm presses on"
        for contact in contacts:
            if contact.link and contact.location_valid:
                self._pushes[contact.number] = contact
        left = self._unexplained(q, torque)
        least = self._least = left if self._least is None else tuple(map(_nearer_zero, self._least, left))
        rises = [abs(a - b) / most for a, b, most in zip(left, least, self._tolerance, strict=True)]
        worst = max(range(len(rises)), key=rises.__getitem__)
        self._beyond = self._beyond + 1 if rises[worst] > 1.0 else 0
        if self._beyond < _RESISTED_SAMPLES:
            return ""
        rise = rises[worst] * self._tolerance[worst]
        return f"joint {worst + 1} takes {rise:.1f} N m more than its touches explain: something resists it"

    def _unexplained(self, q: Joints, torque: Joints) -> Joints:
        left, forces = list(torque), dict.fromkeys(self._pushes, 0.0)
        for _ in range(_FIT_ROUNDS if len(forces) > 1 else 1):
            for number, contact in self._pushes.items():
                push = _push_torque(self._model, q, contact)
                weighted = [g / (w * w) for g, w in zip(push, self._tolerance, strict=True)]
                square = sum(a * b for a, b in zip(push, weighted, strict=True))
                if square <= 0.0:
                    continue
                before = forces[number]
                force = before + sum(a * b for a, b in zip(left, weighted, strict=True)) / square
                force = max(0.0, force if self._yields else min(force, self._most.setdefault(number, max(0.0, force))))
                forces[number] = force
                left = [a - (force - before) * g for a, g in zip(left, push, strict=True)]
        return tuple(left)


def _push_torque(model: ArmModel, q: Joints, contact: ContactOnLink) -> Joints:
    """Return the torques on the joints of a push of 1 N on a touch [N m], at joint positions q [rad]."""
    _, normal, columns = place_point(model, q, contact.link, contact.point, contact.normal)
    return (*(-dot(column, normal) for column in columns), *[0.0] * (model.joints - contact.link))


def _nearer_zero(a: float, b: float) -> float:
    """Return the smaller of two deviations, 0 where they have changed sides."""
    return 0.0 if a * b < 0.0 else min(a, b, key=abs)
