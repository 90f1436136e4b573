"""Tolerance of a sheet as it is built: what its makers hold, and how far the place of a touch is off by it.

None of it can be known from a touch. The six numbers of a contact are what four electrodes can measure: a sheet that is
off by any of this gives those of another place on an ideal one, so the Fisher information on it is zero. A calibration
touches known places and takes most of it off. What is not calibrated is a floor under the covariance of each place.

With x and y parts of the sides, R the sheet's resistance from electrode to electrode, and for the other sheet likewise:

    leads                                  ((1 - x)^2 + x^2) lead^2/R^2
    the electrodes' own lines              (d(x)^2 + d(1 - x)^2 - 4/pi d(x) d(1 - x)) line^2/R^2
    resistance that grows along the sheet  (x (1 - x)/2)^2 slope^2
    patches                                x (1 - x) patches^2 c
    current that runs aslant               h(x, y)^2 skew^2
    an electrode at x = 0 that peels off   (((1 - x) f)^2 + .092 peel^3 exp(-13.4 x length/breadth)) (breadth/length)^2

are variances of x. f = ln sec(pi peel/2)/pi is what the gap throttles; the rest of a peel is fitted to finite elements.
h is the potential of the current that the two insulated edges turn back, a series of odd n:
h = sum 4/(n pi)^2 sin(n pi x) sinh(n pi b (y - 1/2))/cosh(n pi b/2), b the breadth over the length. It is zero on the
middle line, so it is taken further out, by two deviations of y. The drop of a line that is fed at one end grows from 0
to 1/2: d = (1 - x)/3 + 2/pi^2 |cos(pi y)| exp(-pi x/b)/sqrt 2 has its mean and the first term of a series. Which end is
fed is not told: the term counts as if it were the other, less what that is too much in the mean. The drops of two
electrodes have one sign, and oppose each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

from coneskin.core.errors import SensorError

LINE_SHARE: Final = 0.23  #: of a line's ohms: what a lead does like the mean drops of two, which oppose each other
PATCH_SHARE: Final = 0.11  #: of the variance of patches a third of a side wide: what a line through them sees
_OPPOSED: Final = 4.0 / math.pi  # of the product of two drops, each the size of a Gaussian number
_LINE_BEND: Final = math.sqrt(2.0) / math.pi**2  # of a line's ohms: how its drop differs from the mean one
_SKEW_REACH: Final = 2.0  # deviations of a place; what grows with two errors at once has longer tails than one
_PEEL_SHARE: Final = 0.092  # of the cube of a peel; variance at its electrode, over the breadth's square
_PEEL_DECAY: Final = 13.4  # of that variance, over the distance in breadths
_CONTACT_SHARE: Final = 0.25  # of the correction for a contact's size; none is a uniform disc
_PHASE_COUNT: Final = 2  # readings that make a fraction


@dataclass(frozen=True, slots=True)
class SheetTolerance:
    """Standard deviations of what is not ideal about a sheet and its electrodes.

    Attributes:
        slope: change of its resistance from one end to the other, a ratio.
        patches: of its resistance from place to place, a ratio.
        skew: conductance across the direction of the field, over that along it.
        lead: of each wire, beyond what the scene says [ohm].
        line: of each electrode from end to end [ohm].
        drift: of its resistance between learning and touch, a ratio.
        reading: of each reading that no averaging removes (offset, linearity), of the supply.
        contact: distance of a contact's middle from that of a uniform disc [m].
        peel: part of each electrode that may not be bonded.
        map_error: of a calibrated place along and around [m]. With it, the first five and the peel are taken off.

    Raises:
        SensorError: a value is negative or not finite, or a whole electrode peels off.
    """

    slope: float = 0.0
    patches: float = 0.0
    skew: float = 0.0
    lead: float = 0.0
    line: float = 0.0
    drift: float = 0.0
    reading: float = 0.0
    contact: float = 0.0
    peel: float = 0.0
    map_error: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise SensorError(f"tolerance.{item.name} must be finite and not negative, got {value!r}")
        if self.peel >= 1.0:
            raise SensorError(f"tolerance.peel must be less than the whole electrode, 1, got {self.peel!r}")


IDEAL_SHEETS: Final = SheetTolerance()
#: sputtered or printed films: what four-wire touch panels are sold by, a linearity of 1.5 % of a side. A line of silver
#: ink has .01 to .13 ohm per square (Merilampi et al. 2009)
FILM_SHEETS: Final = SheetTolerance(0.03, 0.02, 0.01, 2.0, 2.0, 2e-4, 3e-4, 5e-5, 0.15)
#: hand-cut carbon films and coated textiles
COATED_SHEETS: Final = SheetTolerance(0.10, 0.05, 0.03, 4.0, 10.0, 5e-4, 1e-3, 1e-4, 0.15)
SHEET_CLASSES: Final[dict[str, SheetTolerance]] = {"ideal": IDEAL_SHEETS, "film": FILM_SHEETS, "coated": COATED_SHEETS}


class PlaceFloor:
    """The floor of one sensor's covariances.

    Args:
        tolerance: of its sheets.
        size: length and breadth of the rectangle [m].
        ohms: of the upper sheet from A to B, of the lower from C to D [ohm].
    """

    def __init__(self, tolerance: SheetTolerance, size: tuple[float, float], ohms: tuple[float, float]) -> None:
        self._length, self._breadth = size
        self._leads = (tolerance.lead / ohms[0]) ** 2, (tolerance.lead / ohms[1]) ** 2
        self._lines = (tolerance.line / ohms[0]) ** 2, (tolerance.line / ohms[1]) ** 2
        self._slope, self._patches = 0.25 * tolerance.slope**2, PATCH_SHARE * tolerance.patches**2
        self._skew = tolerance.skew
        self._throttled = (math.log(1.0 / math.cos(0.5 * math.pi * tolerance.peel)) / math.pi) ** 2
        self._bent = _PEEL_SHARE * tolerance.peel**3
        self._reading = _PHASE_COUNT * tolerance.reading**2
        self._contact, self._share = tolerance.contact**2, _CONTACT_SHARE if tolerance != IDEAL_SHEETS else 0.0
        self._mapped = tolerance.map_error

    def at(self, x: float, y: float, move_x: float, move_y: float) -> tuple[float, float, float]:
        """Return the covariances xx, xy, yy in the rectangle [m^2].

        Args:
            x, y: place, as parts of the sides.
            move_x, move_y: what the size of the contact moves it [m].
        """
        share, length, breadth = self._share, self._length, self._breadth
        xx = self._contact + share * share * move_x * move_x
        yy = self._contact + share * share * move_y * move_y
        xy = share * share * move_x * move_y
        xx, yy = xx + self._reading * length * length, yy + self._reading * breadth * breadth
        if self._mapped is not None:
            known = self._mapped * self._mapped
            return xx + known, xy, yy + known
        wide, long = breadth / length, length / breadth
        xx += length * length * self._along(x, y, 0, long) + breadth * breadth * self._peeled(x, long)
        yy += breadth * breadth * self._along(y, x, 1, wide) + length * length * self._peeled(y, wide)
        if self._skew:
            off = _SKEW_REACH * (math.sqrt(yy) / breadth + self._skew * abs(_turned_back(y, x, long)))
            turned_x = self._skew * length * _turned_back(x, y, wide, off)
            off = _SKEW_REACH * (math.sqrt(xx) + abs(turned_x)) / length
            turned_y = self._skew * breadth * _turned_back(y, x, long, off)
            xx, yy = xx + turned_x * turned_x, yy + turned_y * turned_y
        return xx, xy, yy

    def _peeled(self, x: float, ratio: float) -> float:
        """Return the variance by what peels off either electrode, in squares of the breadth."""
        rest, decay = 1.0 - x, -_PEEL_DECAY * ratio
        return self._throttled * (x * x + rest * rest) + self._bent * (math.exp(decay * x) + math.exp(decay * rest))

    def _along(self, x: float, y: float, sheet: int, ratio: float) -> float:
        """Return the variance by leads, lines, slope and patches, in squares of the side along x."""
        rest = 1.0 - x
        both = x * rest
        bend = _LINE_BEND * abs(math.cos(math.pi * y))
        near = rest / 3.0 + bend * math.exp(-math.pi * x * ratio)
        far = x / 3.0 + bend * math.exp(-math.pi * rest * ratio)
        lines = near * near + far * far - _OPPOSED * near * far
        return (
            self._leads[sheet] * (1.0 - 2.0 * both)
            + self._lines[sheet] * lines
            + both * (self._slope * both + self._patches)
        )


def _turned_back(x: float, y: float, ratio: float, off: float = 0.0) -> float:
    """Return h so much farther out, two terms of the series. Beyond an edge it would grow without a bound."""
    y, total = min(1.0, max(0.0, y + math.copysign(off, y - 0.5))), 0.0
    for n in (1.0, 3.0):
        k = n * math.pi
        bent = k * ratio * (y - 0.5)
        end = 0.5 * k * ratio
        # sinh over cosh, of large arguments too
        part = (math.exp(abs(bent) - end) - math.exp(-abs(bent) - end)) / (1.0 + math.exp(-2.0 * end))
        total += 4.0 / (k * k) * math.sin(k * x) * (part if bent > 0.0 else -part)
    return total
