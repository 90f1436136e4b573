"""Outcome of a collision in physics: what the body had to bear, and how soon the arm stood.

The recorders keep what only physics knows for a recording: forces, places of the bodies, and touches, by which the
run's detected touches are judged. All of it is pure.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from coneskin.core.recording.block import Block
from coneskin.geometry.pose import Vector
from coneskin.robot.guard.signals.journal import BlockKind, force_block
from coneskin.skin.virtual.imperfections import ContactLaw
from coneskin.skin.virtual.skin import Press

if TYPE_CHECKING:
    from .mujoco_plant import MujocoPlant

_REPEAT_PERIOD = 10.0  # s after which what was told is told again, for who looks on from later
_MIN_BODY_MOTION = 1e-4  # m by which a body that nothing touches must have moved


class TruthRecorder:
    """Recorder that makes a block of what has changed, at most one in a period [s] while a force only changes."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._time = -math.inf
        self._force = 0.0
        self._places: tuple[Vector, ...] = ()

    def feed(self, time: float, force: float, places: Sequence[Vector]) -> Block | None:
        """Return the block of an instant; None where it tells nothing new, or comes too soon.

        The first force, and its end, are told whenever they come.

        Args:
            time: host clock [s].
            force: sum of all contacts [N].
            places: of the bodies' parts, in the base frame [m].
        """
        turned = (force > 0.0) != (self._force > 0.0)
        if not turned and time - self._time < self._period:
            return None
        moved = max(map(math.dist, places, self._places), default=0.0) if self._places else 0.0
        if force == self._force and moved < _MIN_BODY_MOTION and not -math.inf < self._time <= time - _REPEAT_PERIOD:
            if not self._places:
                self._places = tuple(places)
            return None
        self._time, self._force, self._places = time, force, tuple(places)
        return force_block(time, force, places)


_MIN_TOUCH_FORCE = ContactLaw().threshold_force  # N
_TOUCH_GAP = 0.1  # s without a press after which a touch is over; a body that rebounds sooner has made one touch


class TouchRecorder:
    """Recorder of touches: of one sensor at a time, whatever number of bodies makes it.

    A touch is a force above that at which the layers of a skin meet: below it no skin feels anything. It is told twice,
    as it begins, with the end None, and once it is over: a run may end while a body rests on the arm.
    """

    def __init__(self) -> None:
        self._open: dict[str, dict[str, Any]] = {}
        self._pressed: dict[str, float] = {}  # when each of them was last
        self._silent = True

    def feed(self, time: float, presses: Iterable[Press]) -> Block | None:
        """Return the block of what has begun or ended by a time of the host [s]; None where nothing has.

        The first one is always there.
        """
        sums: dict[str, float] = {}
        strongest: dict[str, Press] = {}
        for press in presses:
            sums[press.sensor] = sums.get(press.sensor, 0.0) + press.force
            if press.force > strongest.get(press.sensor, press._replace(force=-math.inf)).force:
                strongest[press.sensor] = press
        told = []
        for sensor, force in sums.items():
            if force <= _MIN_TOUCH_FORCE:
                continue
            if sensor not in self._open:
                at = strongest[sensor]
                place = {"u": at.u, "phi": at.phi, "force": force, "radius": at.radius}
                self._open[sensor] = {"sensor": sensor, "start": time, "end": None, **place}
                told.append(self._open[sensor])
            self._pressed[sensor] = time
        for sensor in [name for name in self._open if time - self._pressed[name] > _TOUCH_GAP]:
            told.append(self._open.pop(sensor) | {"end": self._pressed[sensor]})
        if not told and not self._silent:
            return None
        self._silent = False  # nothing told would be nothing known
        return Block(BlockKind.TRUTH, time, json.dumps({"pressed": told}).encode())


#: s after the first contact from which on a force counts as clamping; ISO/TS 15066, 5.5.5.3: a transient contact is
#: over by then
CLAMP_TIME = 0.5
_STANDSTILL_SPEED = 0.01  # rad/s below which a joint counts as standing
_STANDSTILL_TIME = 0.005  # s for which all must; a reaction moves the arm again soon after


@dataclass(frozen=True, slots=True)
class ImpactOutcome:
    """Outcome of one collision. Times count from the first contact."""

    peak: float  #: greatest force of one skin on one body [N]
    clamp: float  #: sum of all forces after ``CLAMP_TIME`` [N]
    impulse: float  #: of all forces until then [N s]
    depth: float  #: greatest indentation of the padding [m]
    approach: float  #: speed of the surfaces towards each other as they met [m/s]
    noticed: float  #: when the guard, or the force limit, gave its first command [s]; NaN where it gave none
    standstill: float  #: when the arm first stood, measured [s]; NaN where it did not


class ImpactMeter:
    """Meter of one collision, which is shown the plant after each step.

    Attributes:
        began: time of the first contact [s]; NaN before.
    """

    def __init__(self) -> None:
        self.began = math.nan
        self._approach = self._clamp = self._impulse = self._peak = self._depth = 0.0
        self._noticed = self._stood = self._now = math.nan

    @property
    def over(self) -> bool:
        """True once the clamping force was taken."""
        return self._now - self.began > CLAMP_TIME

    def feed(self, time: float, plant: MujocoPlant) -> None:
        """Take the plant as it is at a time [s]."""
        if math.isnan(self.began):
            if plant.peak <= 0.0:
                return
            self.began, self._approach = time, max((contact.rate for contact in plant.contacts), default=0.0)
        self._peak, self._depth = plant.peak, plant.deepest
        if time - self.began <= CLAMP_TIME:
            self._impulse, self._clamp = plant.impulse, plant.force
        speed = max(map(abs, plant.qd))
        if self._now - self._stood < _STANDSTILL_TIME and speed > _STANDSTILL_SPEED:
            self._stood = math.nan
        elif math.isnan(self._stood) and speed <= _STANDSTILL_SPEED:
            self._stood = time
        self._now = time

    @property
    def noticed(self) -> bool:
        """True once the first command of what protects the body came."""
        return not math.isnan(self._noticed)

    def notice(self, time: float) -> None:
        """Take the first command of what protects the body [s]."""
        if math.isnan(self._noticed):
            self._noticed = time

    @property
    def outcome(self) -> ImpactOutcome:
        """Outcome so far."""
        stood = self._stood if self._now - self._stood >= _STANDSTILL_TIME else math.nan
        return ImpactOutcome(
            self._peak,
            self._clamp,
            self._impulse,
            self._depth,
            self._approach,
            self._noticed - self.began,
            stood - self.began,
        )
