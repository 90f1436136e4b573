"""Tolerance of a sheet as it is built: what its makers hold, and how far the place of a touch is off by it.

None of it can be known from a touch. The six numbers of a contact are what four electrodes can measure: a sheet that is
off by any of this gives those of another place on an ideal one, so the Fisher information on it is zero. A calibration
touches known places and takes most of it off. What is not calibrated is a floor under the covariance of each place.

With x and y parts of the sides, R the sheet's resistance from electrode to electrode, and for the other sheet likewise:

    leads and the electrodes' own lines    ((1 - x)^2 + x^2) ohm^2/R^2
    resistance that grows along the sheet  (x (1 - x)/2)^2 slope^2
    patches                                x (1 - x) patches^2 c
    current that runs aslant               h(x, y)^2 skew^2
    an electrode at x = 0 that peels off   (((1 - x) f)^2 + .092 peel^3 exp(-13.4 x length/breadth)) (breadth/length)^2

are variances of x. f = ln sec(pi peel/2)/pi is what the gap throttles; the rest of a peel is fitted to finite elements.
h is the potential of the current that the two insulated edges turn back, a series of odd n:
h = sum 4/(n pi)^2 sin(n pi x) sinh(n pi b (y - 1/2))/cosh(n pi b/2), b the breadth over the length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

from coneskin.core.errors import SensorError

LINE_SHARE: Final = 0.23  #: of an electrode's own resistance: its mean drop is 1/3, and both electrodes' oppose
PATCH_SHARE: Final = 0.11  #: of the variance of patches a third of a side wide: what a line through them sees
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
        SensorError: a value is negative or not finite.
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
        leads = math.sqrt(tolerance.lead**2 + (LINE_SHARE * tolerance.line) ** 2)
        self._leads = (leads / ohms[0]) ** 2, (leads / ohms[1]) ** 2
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
        skew = self._skew
        turned_x = skew * _turned_back(x, y, breadth / length) if skew else 0.0
        turned_y = skew * _turned_back(y, x, length / breadth) if skew else 0.0
        return (
            xx
            + length * length * (self._along(x, self._leads[0]) + turned_x * turned_x)
            + breadth * breadth * self._peeled(x, length / breadth),
            xy,
            yy
            + breadth * breadth * (self._along(y, self._leads[1]) + turned_y * turned_y)
            + length * length * self._peeled(y, breadth / length),
        )

    def _peeled(self, x: float, ratio: float) -> float:
        """Return the variance by what peels off either electrode, in squares of the breadth."""
        rest, decay = 1.0 - x, -_PEEL_DECAY * ratio
        return self._throttled * (x * x + rest * rest) + self._bent * (math.exp(decay * x) + math.exp(decay * rest))

    def _along(self, x: float, leads: float) -> float:
        rest = 1.0 - x
        both = x * rest
        return leads * (1.0 - 2.0 * both) + both * (self._slope * both + self._patches)


def _turned_back(x: float, y: float, ratio: float) -> float:
    """Return h: two terms of the series."""
    total = 0.0
    for n in (1.0, 3.0):
        k = n * math.pi
        bent = k * ratio * (y - 0.5)
        end = 0.5 * k * ratio
        # sinh over cosh, of large arguments too
        part = (math.exp(abs(bent) - end) - math.exp(-abs(bent) - end)) / (1.0 + math.exp(-2.0 * end))
        total += 4.0 / (k * k) * math.sin(k * x) * (part if bent > 0.0 else -part)
    return total
