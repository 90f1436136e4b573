"""Guides of an untouched sensor: what the radial and angular phases show although the touch phase shows nothing.

A dead touch phase reads 0 for ever, and so does an untouched sensor. But nothing joins the layers then, so no guide may
have a potential, and the guides of a phase cannot differ. A leak that grows slowly is learned; what comes suddenly is a
contact, and without a rise of the level it is one that the touch phase does not see.
"""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.skin.wire import Frame

from .currents import UntouchedCurrents, bounded

__all__ = ["GUIDE_JUMP", "UntouchedGuides"]

GUIDE_JUMP = 0.01  #: part of the supply; a sudden potential of a guide, or a difference of two, that nothing explains
_MAX_JUMP = 0.03  # part of the supply; what noise raises that to at most
_GUIDE_DEVIATIONS = 7.0  # standard deviations of noise that are no potential
_MAX_GUIDE_GROWTH = 0.1  # parts of the supply a second; the fastest growth that is learned, a leak's
_LEVEL_COUNTS = 1.5  # counts; a change of the level by this explains what the guides show


class UntouchedGuides:
    """The potentials that the guides of an untouched sensor have by a leak between the layers.

    Args:
        currents: of the untouched sensor, with the noise that was learned.
    """

    __slots__ = ("_angular", "_currents", "_known", "_level", "_radial")

    def __init__(self, currents: UntouchedCurrents) -> None:
        self._currents = currents
        self._radial = self._angular = self._level = 0.0
        self._known = False

    def contradict(self, frame: Frame, level: float, period: float) -> bool:
        """Tell whether the guides show a contact that the level does not.

        Args:
            frame: one whose level is below the release threshold.
            level: its level.
            period: time from frame to frame [s].
        """
        supply = frame.touch_supply
        radial = 0.5 * (frame.radial_c + frame.radial_d) / frame.radial_supply
        angular = 0.5 * (frame.angular_a + frame.angular_b) / frame.angular_supply
        if not self._known:
            self._radial, self._angular, self._level, self._known = radial, angular, level, True
        step1, step2 = radial - self._radial, angular - self._angular
        split1, split2 = frame.radial_c - frame.radial_d, frame.angular_a - frame.angular_b
        differ = GUIDE_JUMP * supply
        if (
            step1 > GUIDE_JUMP
            or step2 > GUIDE_JUMP
            or not (-differ <= split1 <= differ and -differ <= split2 <= differ)
        ):
            return (level - self._level) * supply < _LEVEL_COUNTS and self._exceed_noise(
                step1, step2, split1 / supply, split2 / supply, supply
            )
        most = _MAX_GUIDE_GROWTH * period
        self._radial += bounded(step1, most)
        self._angular += bounded(step2, most)
        self._level += bounded(0.1 * (level - self._level), most)  # a step of the noise is not followed
        return False

    def learn(
        self, radial: Sequence[float], angular: Sequence[float], levels: Sequence[float], periods: Sequence[float]
    ) -> int:
        """Take frames in a row as ``contradict`` does; return how many, up to the first that may contradict.

        Args:
            radial: mean potential of the guides in the radial phase over the supply; those of a pair do not differ.
            angular: the same in the angular phase.
            levels: of the frames.
            periods: time from frame to frame [s].
        """
        if not self._known:
            return 0
        count, mine, others, known = 0, self._radial, self._angular, self._level
        for count, (one, other, level, period) in enumerate(zip(radial, angular, levels, periods, strict=True), 1):
            step1, step2 = one - mine, other - others
            if step1 > GUIDE_JUMP or step2 > GUIDE_JUMP:
                count -= 1
                break
            most = _MAX_GUIDE_GROWTH * period
            mine += most if step1 > most else -most if step1 < -most else step1
            others += most if step2 > most else -most if step2 < -most else step2
            step = 0.1 * (level - known)
            known += most if step > most else -most if step < -most else step
        self._radial, self._angular, self._level = mine, others, known
        return count

    def _exceed_noise(self, step1: float, step2: float, split1: float, split2: float, supply: int) -> bool:
        """Tell whether steps, or differences, are more than noise leaves in as many readings."""
        noise = _GUIDE_DEVIATIONS * self._currents.noise / supply
        step, split = (
            min(max(0.7 * noise, GUIDE_JUMP), _MAX_JUMP),
            min(max(1.4 * noise, GUIDE_JUMP), _MAX_JUMP),
        )
        return step1 > step or step2 > step or abs(split1) > split or abs(split2) > split
