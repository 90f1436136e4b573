"""Recorder of the touches that bodies make: labels of a run in physics, by which its contacts are judged. Pure."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.skin.virtual.pressed_skin import Press
from coneskin.skin.virtual.substrate import ContactLaw

__all__ = ["TouchRecorder"]

_FELT = ContactLaw().threshold_force  # N
_APART = 0.1  # s without a press after which a touch is over; a body that rebounds sooner has made one touch


class TouchRecorder:
    """Recorder of touches: of one sensor at a time, whatever number of bodies makes it.

    A touch is a force above that at which the layers of a skin meet: below it no skin feels anything. It is told twice,
    as it begins, with the end None, and once it is over: a run may end while a body rests on the arm.
    """

    def __init__(self) -> None:
        self._open: dict[str, dict[str, Any]] = {}
        self._pressed: dict[str, float] = {}  # when each of them was last
        self._silent = True

    def take(self, time: float, presses: Iterable[Press]) -> Block | None:
        """Return the block of what has begun or ended; None where nothing has. The first one is always there.

        Args:
            time: host clock [s].
            presses: that there are now.
        """
        sums: dict[str, float] = {}
        strongest: dict[str, Press] = {}
        for press in presses:
            sums[press.sensor] = sums.get(press.sensor, 0.0) + press.force
            if press.force > strongest.get(press.sensor, press._replace(force=-math.inf)).force:
                strongest[press.sensor] = press
        told = []
        for sensor, force in sums.items():
            if force <= _FELT:
                continue
            if sensor not in self._open:
                at = strongest[sensor]
                place = {"u": at.u, "phi": at.phi, "force": force, "radius": at.radius}
                self._open[sensor] = {"sensor": sensor, "start": time, "end": None, **place}
                told.append(self._open[sensor])
            self._pressed[sensor] = time
        for sensor in [name for name in self._open if time - self._pressed[name] > _APART]:
            told.append(self._open.pop(sensor) | {"end": self._pressed[sensor]})
        if not told and not self._silent:
            return None
        self._silent = False  # nothing told would be nothing known
        return Block(BlockKind.TRUTH, time, json.dumps({"pressed": told}).encode())
