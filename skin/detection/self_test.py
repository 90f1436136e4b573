"""Self-test of the frames of a touch: what each says twice, as one chi-squared.

Whatever joins two sheets, their network is linear and reciprocal. So the radial and the angular phase must tell the
same P_xy, and the guides of the touch phase must differ as both say (`contact_matrix`). Neither depends on the
contacts, on the leads or on the sheets, and hardly on a contact's motion between the phases. Both depend on the gains
of the inputs. The drive current's sum rule, the third that is left over, is `reading`'s.

The deviations are over limits that noise passes once in 1e10 frames. One frame is not a fault: a contact that comes or
goes between the phases passes them too.
"""

from __future__ import annotations

import math

from coneskin.skin.sensor import Sensor

from .frame.contact_matrix import ContactMatrix
from .frame.untouched import UntouchedCurrents

_RECIPROCITY_LIMIT = 0.005  # of the supply, on a guide; a slide at 1 m/s leaves 4e-7, two contacts growing 10 %/ms 4e-4
_SPLIT_LIMIT = 0.2  # of the supply; the same leave 0.014 and 0.03, a shunt 10 % off 0.14, pull-downs 1 % apart 0.1
_DRAWN_LIMIT = 0.08  # of the touch phase's drive current; a pull-down and a shunt of 1 %, and an amplifier, leave 0.03
# a third of the chi-squared each: below all, no more is computed
_RECIPROCITY_THIRD, _SPLIT_THIRD, _DRAWN_THIRD = 0.57 * _RECIPROCITY_LIMIT, 0.57 * _SPLIT_LIMIT, 0.57 * _DRAWN_LIMIT
_LIMIT_DEVIATIONS = 7.0  # standard deviations of the noise of one frame
_DOUBT_FRAMES = 50  # by which the frames that deviate outnumber those that do not


class FrameSelfTest:
    """The self-test of the frames of one sensor.

    Args:
        currents: of the untouched sensor, with the noise that was learned.
    """

    def __init__(self, sensor: Sensor, currents: UntouchedCurrents) -> None:
        self._currents = currents
        parts = sensor.electronics
        self._pulldown = parts.pulldown_ohms
        self._noise_drawn = (parts.current_full_scale / parts.adc_volts) ** 2 + 2.0 / self._pulldown**2
        self._scale = 1.0 / (1.0 + currents.aspect**4)
        self._count = 0

    def feed(self, matrix: ContactMatrix) -> bool:
        """Take a valid frame that has a firm place. Tell whether its guides have contradicted each other for long."""
        most, drawn = _RECIPROCITY_THIRD * matrix.around, _DRAWN_THIRD * self._drawn(matrix)
        if (
            -most <= matrix.reciprocity <= most
            and -_SPLIT_THIRD <= matrix.split <= _SPLIT_THIRD
            and -drawn <= matrix.sum_rule <= drawn
        ) or self.deviation(matrix) < 1.0:
            if self._count:
                self._count -= 1
            return False
        self._count += 1
        return self._count >= _DOUBT_FRAMES

    @property
    def doubted(self) -> bool:
        """True while frames that deviate outnumber those that do not: the place may be wrong."""
        return self._count > 0

    def deviation(self, matrix: ContactMatrix) -> float:
        """Return how far a frame contradicts itself, over the limit."""
        along, around = matrix.along, matrix.around
        noise = _LIMIT_DEVIATIONS**2 * self._currents.spread[0] * self._scale  # of a guide, over the supply
        share = 1.0 + around * self._pulldown
        sheets = along * along + around * around
        reciprocity = matrix.reciprocity**2 / ((_RECIPROCITY_LIMIT**2 + 2.0 * noise) * sheets)
        drawn = matrix.sum_rule**2 / ((_DRAWN_LIMIT * self._drawn(matrix)) ** 2 + self._noise_drawn * noise)
        return math.sqrt(reciprocity + drawn + matrix.split**2 / (_SPLIT_LIMIT**2 + 8.0 * share * share * noise))

    def lacks_current(self, matrix: ContactMatrix) -> bool:
        """Tell whether the drive current alone contradicts a frame, and is too small."""
        return self.deviation(matrix._replace(sum_rule=0.0)) < 1.0 and matrix.sum_rule < 0.0

    def _drawn(self, matrix: ContactMatrix) -> float:
        """Return the drive current of the touch phase over the supply [S], within the drop in the sheets."""
        return matrix.conductance / (1.0 + 0.5 * self._pulldown * matrix.conductance)

    def begin(self) -> None:
        """Forget the frames: another touch."""
        self._count = 0
