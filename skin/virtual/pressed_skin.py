"""Virtual skin that is pressed from outside, frame by frame, by bodies that an arm runs into, beside its script."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import Any, NamedTuple

from coneskin.skin.sensor import Sensor

from .circuit import LayerContact
from .scripted_touch import ScriptedTouch
from .skin import VirtualSkin

__all__ = ["Press", "PressedSkin"]

_FORCE_DIGITS = 3  # decimals of a force [N]: below a count, and a pressure that rests need not be solved again
_FINE_STEPS = 1e-5, 1e-5  # of u [m] and phi [rad]: a contact that rests within 10 um is the same
_COARSE_STEPS = 2e-4, 1e-3  # the same where time counts: the field of a new place takes 0.8 ms
_REACH_STEP = 1e-3  # m; the field of a place is solved for contacts up to a multiple of this
_RESTED = 1e-3  # N of the foam's state from which on a body that is gone is forgotten


class Press(NamedTuple):
    """Force of one body on one sensor."""

    sensor: str  #: its name
    u: float  #: slant distance of the middle from end 1 [m]
    phi: float  #: azimuth of the middle [rad]
    force: float  #: [N]
    radius: float = 0.0  #: of a flat face [m]; 0 for a round body


class PressedSkin(VirtualSkin):
    """Virtual skin of bodies; foam and layers yield as those of any virtual skin.

    Args:
        sensors: of the device.
        touches: the script.
        coarse: let contacts move in steps of 0.2 mm and 1 mrad, where bytes are wanted in real time.
        options: of `VirtualSkin`, by name.
    """

    def __init__(
        self, sensors: Sequence[Sensor], touches: Sequence[ScriptedTouch] = (), *, coarse: bool = False, **options: Any
    ) -> None:
        super().__init__(sensors, touches, **options)
        self._steps = _COARSE_STEPS if coarse else _FINE_STEPS
        self._cones = {sensor.name: sensor.frustum for sensor in sensors}
        self._delayed: dict[Hashable, tuple[float, Press]] = {}  # state of the foam below each [N]
        self._now: dict[str, tuple[LayerContact, ...]] = {}

    def press(self, presses: Mapping[Any, Press], step: float) -> None:
        """Let bodies press for a time; the next frame shows what came of it.

        Args:
            presses: what presses, by what tells one body from another; a body that is not there presses no more.
            step: for how long [s].
        """
        foam, layers = self.imperfections.foam, self.imperfections.layers
        found: dict[str, list[LayerContact]] = {}
        kept: dict[Hashable, tuple[float, Press]] = {}
        for body in dict.fromkeys((*self._delayed, *presses)):
            before, last = self._delayed.get(body, (0.0, None))
            press = presses.get(body) or (last._replace(force=0.0) if last is not None else None)
            if press is None:
                continue
            state = foam.advance(before, press.force, step)
            if press.force > 0.0 or state > _RESTED:
                kept[body] = state, press
            seated = round(foam.seated(state, press.force), _FORCE_DIGITS)
            if seated > layers.threshold_force:
                contact = layers.touch(seated, press.radius)
                cone = self._cones[press.sensor]
                u, phi = _rounded(press.u, cone.slant, self._steps[0]), _rounded(press.phi, cone.wrap, self._steps[1])
                reach = _REACH_STEP * math.ceil(contact.radius / _REACH_STEP)
                item = LayerContact(u, phi, contact.siemens, contact.radius, reach)
                found.setdefault(press.sensor, []).append(item)
        self._delayed = kept
        self._now = {name: tuple(contacts) for name, contacts in found.items()}

    def _contacts(self, sensor: Sensor, time: float) -> tuple[LayerContact, ...]:
        return (*super()._contacts(sensor, time), *self._now.get(sensor.name, ()))


def _rounded(value: float, most: float, step: float) -> float:
    """Return a coordinate in steps; one at the edge stays on the sheet."""
    rounded = step * round(value / step)
    return most if value <= most < rounded else rounded
