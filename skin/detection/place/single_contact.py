"""Test whether the contact on a sensor can be two: what the drive currents and the guides' split say of its shape.

Together the contacts add a tensor P to the conductances along and around the sheets (docs/understand/field.md): P_xx to
the radial drive current, P_yy to the angular one, P_xy splits the guides. One disc adds equally in all directions, at
most as much as the largest disc that has the measured conductance G. Two contacts of conductance G1 and G2 at a
distance s add G1 G2 s^2/(G1 + G2) along the line between them and nothing across. So the inequality of P, over the
square of a distance, is the conductance of the second contact: everything here is in siemens at a distance of
DANGEROUS_ANGLE about the axis.

Contacts that lie evenly round a place, at a distance s from it, add equally as well: G s^2/2, or more where they press
firmly, for the sheets part them. A disc of radius a adds G a^2/4 where it presses lightly. So a limit on the radius of
one contact tells it from all that lies round it: no contact needs to be known by itself.
"""

from __future__ import annotations

import math
from typing import Final

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import UntouchedCurrents
from coneskin.skin.sensor import Sensor

WEAK = "it presses too lightly for a place"  #: below the level from which places are told
CONTRADICTS = "the guides of a phase differ too much for one contact"  #: the frame itself
#: a sheet or a bond is another, and so is the place that a reading means
ALTERED = "a drive current is not what it was: look at the sheet and its electrodes, and run coneskin doctor"
MOVES = "it has only begun, or moves"  #: the place is not that of the frame before


#: Azimuth by which a place may be off every contact [rad]: a motion along its normal goes away from them all.
DANGEROUS_ANGLE: Final = math.radians(20.0)

_PAIR_DEVIATIONS: Final = 3.0  # standard deviations of the averaged noise that may stand against the evidence
_PAIR_FRAMES: Final = 512  # frames; the average reaches back so far
# ratio; a disc of 15 mm at an edge adds 1.04 times what the largest one may, contacts round it 1.17
_DISC_TOLERANCE = 1.1
_LARGEST_ANGLE: Final = 1.3 * DANGEROUS_ANGLE  # of a radius: a larger disc adds less than contacts at that angle
_CERTAIN_SHARE: Final = 0.9  # of the limit; what is not certain must fall below it to become so

_CURRENTS_UNKNOWN: Final = "the untouched drive currents are not known yet"
_TOO_FEW_FRAMES: Final = "too few frames yet to exclude a second contact"
_SEVERAL_CONTACTS = (
    "the drive currents rise unequally, or the guides differ: several contacts, a long one, or a sheet that has changed"
)
_LARGE_CONTACT = "the drive currents rise more than by one contact: several round this place, or a very large one"
_COARSE_READINGS: Final = "the readings are too coarse to exclude a second contact so lightly touched"


class SingleContactTest:
    """The evidence of one touch, averaged over its frames.

    Args:
        settings: the weakest second contact, the largest single one.
        currents: of the untouched sensor.
    """

    def __init__(self, sensor: Sensor, settings: DetectorSettings, currents: UntouchedCurrents) -> None:
        parts, cone = sensor.electronics, sensor.frustum
        self._currents = currents
        aspect = currents.aspect
        self._angles = (cone.wrap / DANGEROUS_ANGLE) ** 2
        # siemens at DANGEROUS_ANGLE for a count of current over a count of supply
        self._unit = parts.current_full_scale / parts.adc_volts * self._angles
        self._pulldown = 2.0 / parts.pulldown_ohms
        self._limit = settings.second_contact
        self._radius1, self._taper = cone.radius1, cone.sin_half_angle
        self._per_along, self._per_cross = self._angles * aspect**2, 2.0 * self._angles * aspect
        self._largest = settings.largest_contact
        self._scale = self._unit * max(1.0, _split_noise(sensor, aspect))
        self.begin()

    def begin(self) -> None:
        """Forget the evidence: another touch, or another place."""
        self._evidence = 0, 0.0, 0.0, 0.0, 0.0, 0.0  # frames; means of the inequality, across, rise, required, disc
        self._certain = False
        self._sheets = self._currents.sheets()

    def largest_disc(self, u: float) -> float:
        """Return the radius up to which one contact at u [m] is taken for one [m]."""
        return min(self._largest, _LARGEST_ANGLE * (self._radius1 + self._taper * u))

    def feed(self, matrix: ContactMatrix, level: float, u: float, disc: float | None) -> str:
        """Take a frame of the touch.

        Args:
            matrix: of a valid frame.
            level: its level, the drift taken off.
            u: where it is read [m].
            disc: dipole of the largest disc that has the conductance of the touch [S m^2]; None with the first frame.

        Returns:
            why there may be more than one contact. Empty once that is excluded.
        """
        variance, bias = self._currents.spread
        learned = self._currents.means[0]
        if not learned:
            return _CURRENTS_UNKNOWN
        frames, differ, across, mean, required, widest = self._evidence
        if frames < _PAIR_FRAMES:
            frames += 1
        gain, limit = 1.0 / frames, self._limit
        upper, lower = self._sheets
        rise1, rise2 = self._per_along * (matrix.along - upper), self._angles * (matrix.around - lower)
        total = level / (1.0 - level) * self._pulldown if level < 0.999 else limit
        differ += gain * (rise2 - rise1 - differ)
        across += gain * (self._per_cross * matrix.cross - across)
        mean += gain * (0.5 * (rise1 + rise2) - mean)
        if disc is not None:
            distance = DANGEROUS_ANGLE * (self._radius1 + self._taper * u)
            largest = _DISC_TOLERANCE * disc / (distance * distance)
            widest = widest + gain * (largest - widest) if widest else largest
        required += gain * ((total if total < limit else limit) - required)
        self._evidence = frames, differ, across, mean, required, widest
        # what is seen, compared with what the weakest dangerous pair would show
        noise = self._scale * math.sqrt(variance * (gain + 1.0 / learned))
        slack = _PAIR_DEVIATIONS * noise + self._unit * bias
        seen = math.sqrt(differ * differ + across * across)
        # What was excluded once is not doubted again for noise: one standard deviation is left of three.
        limit, held = (required, slack / _PAIR_DEVIATIONS) if self._certain else (_CERTAIN_SHARE * required, slack)
        self._certain = False
        if seen + held > limit:
            if seen - slack > limit:
                return _SEVERAL_CONTACTS
            return _TOO_FEW_FRAMES if frames < _PAIR_FRAMES else _COARSE_READINGS
        # the mean of two rises has half the noise of their difference
        if disc is not None and mean + 0.5 * held > widest:
            return _LARGE_CONTACT if mean - 0.5 * slack > widest or frames >= _PAIR_FRAMES else _TOO_FEW_FRAMES
        self._certain = True
        return ""


def _split_noise(sensor: Sensor, aspect: float) -> float:
    """Return the noise of 2 P_xy over that of P_yy - P_xx."""
    own1, own2 = (
        amperes / sensor.electronics.current_full_scale * sensor.electronics.adc_volts / sensor.electronics.supply_volts
        for amperes in (sensor.radial_amperes, sensor.angular_amperes)
    )
    return aspect * math.sqrt(2.0 * (own1 * own1 + own2 * own2) / (1.0 + aspect**4))


def weakest_pair_excluded(sensor: Sensor, frames: int = 100) -> float:
    """Return how weak a second contact may be that a certain place excludes [S].

    A contact at least this conductive (spreading in the sheets included) whose normal is DANGEROUS_ANGLE off the place
    that is read does not leave that place certain. Farther off, at an angle b, one weaker by (DANGEROUS_ANGLE/b)^2 does
    not either. Where this is above ``DetectorSettings.second_contact``, no place is certain after so many frames.

    Args:
        frames: of the touch that are averaged, up to 512, with the noise that is assumed before any is learned.
    """
    currents = UntouchedCurrents(sensor, 0.0)
    parts = sensor.electronics
    unit = parts.current_full_scale / parts.adc_volts * (sensor.frustum.wrap / DANGEROUS_ANGLE) ** 2
    noise = math.sqrt(currents.spread[0] / min(frames, _PAIR_FRAMES))
    return unit * _PAIR_DEVIATIONS * max(1.0, _split_noise(sensor, currents.aspect)) * noise / _CERTAIN_SHARE


def frames_until_certain(sensor: Sensor, settings: DetectorSettings) -> int | None:
    """Return after how many frames of a firm touch by one contact its place is certain. None where it never is."""
    one = weakest_pair_excluded(sensor, 1)  # it falls with the square root of the number of frames
    frames = max(1, math.ceil((one / settings.second_contact) ** 2))
    return frames if frames <= _PAIR_FRAMES else None
