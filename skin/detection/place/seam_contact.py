"""Press over the seam: one body on both straight edges of a sheet that is wrapped around a link.

The sheet is cut at the seam, so such a press is two contacts, at y near 0 and near 1 of the wrap, and its electrical
centre lies anywhere between them, on the other side of the link too. With the conductances w of its contacts

    G Y (1 - Y) - P_yy (1 - Gamma G) = sum of w y (1 - y),

Gamma the coupling that the two straight edges have through the upper sheet. For two contacts at the edges this is
exact. Each term on the right is positive: the sum over G is the mean distance of all contacts from the seam, and where
it is small, no strong contact is far from there. That excludes two hands which are not both at the seam. Two that are
both within the dangerous angle of it have nearly one normal, and are one press as far as a motion goes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, MatrixNoise
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor

from .place_estimate import PlaceEstimator, SheetConductances
from .single_contact import CONTRADICTS, DANGEROUS_ANGLE, MOVES

_MAX_GAP = math.radians(24.0)  # between the straight edges; beyond, the wrap does not close
_MIN_FAR_SHARE = 0.05  # P_yy over G below which hardly anything is on the other side of the seam
_SEAM_DISTANCE = 0.5  # of the spread about the electrical centre; contacts that are nearer to the seam belong to it
_SEAM_DEVIATIONS = 3.0  # standard deviations of the noise that may stand against the evidence
_SEAM_MODEL_ERROR = 0.02  # of P_yy; gains of the two phases, and the coupling
_SEAM_MARGIN = 0.8  # of the limit; two contacts that are not quite at the edges show a little less
_MAX_ALONG_SHARE = 2.0  # of the second contact, at the dangerous angle's distance along the side
_COUPLING_TERMS = 12
# place of a disc over its mean distance, by how unequal its two parts are
_OFFSET_1, _OFFSET_3, _OFFSET_5 = 1.85, -1.1, 0.25
_ACROSS_DEVIATION = 0.5  # of the mean distance; standard deviation of the centroid across the seam
_ALONG_DEVIATION = 0.1  # of the mean distance; likewise along the side

_MIN_SEAM_SHARE = 0.02  # P_yy over G; a press over the seam has more, and most touches are told from one by this alone
_CONDUCTANCE_CHANGE = 0.05  # ratio by which the conductance may differ from its mean

_OVER_SEAM = "it presses on both sides of the seam: too far from it, or too long, for one contact"


class SeamPlace(NamedTuple):
    """Centroid of a press over the seam."""

    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth, from 0 to a whole turn; it may lie in the gap [rad]
    covariance: tuple[float, float, float]  #: uu, us, ss [m^2]
    doubt: str  #: why it may not be one press at the seam; empty where it is
    elongation: tuple[float, float]  #: half length [m] and direction of the line across the seam [rad]


class SeamCertainty:
    """The presses over the seam of one sensor.

    Args:
        settings: how far a place may move while it is certain, and the weakest second contact that is to be excluded.
        breadth: of the wrap at the wider end [m].

    Attributes:
        closes: the wrap closes, so that one body can press on both edges.
    """

    def __init__(self, sensor: Sensor, settings: DetectorSettings, estimator: PlaceEstimator, breadth: float) -> None:
        cone = sensor.frustum
        self._wrap, self._radius_at = cone.wrap, cone.radius_at
        self._gap = 0.5 * max(0.0, 2.0 * math.pi - cone.wrap)  # [rad], from an edge to the middle of the seam
        self.closes = 2.0 * self._gap <= _MAX_GAP
        self._limit = settings.second_contact
        self._angle = (DANGEROUS_ANGLE - self._gap) / cone.wrap  # of the wrap
        self._estimator = estimator
        aspect = estimator.breadth / estimator.length
        self._coupling = tuple(
            2.0 / (math.pi * n * math.sinh(min(n * math.pi * aspect, 300.0))) for n in range(1, _COUPLING_TERMS + 1)
        )
        self._map, self._lower = sensor.place_map, estimator.sheets[1]
        self._settle = settings.settle_distance**2
        self._breadth = breadth
        self._before: tuple[float, float] | None = None  # place in the frame before
        self._held = False  # it was certain

    def _place(
        self, matrix: ContactMatrix, one: MatrixNoise, frames: float, sheets: SheetConductances
    ) -> SeamPlace | None:
        """Return the centroid of a press over the seam. None where what presses does not lie on both its sides.

        Args:
            matrix: of one frame, or the mean over some.
            one: noise of one frame's matrix.
            frames: number of frames in the mean.
            sheets: without contact.
        """
        whole, x, y = matrix[:3]
        around = matrix.around - sheets.lower
        if not self.closes or not 0.0 <= y <= 1.0 or not around > _MIN_FAR_SHARE * whole > 0.0:
            return None
        coupled = self._coupled(x, sheets.upper) * whole
        if not coupled < 1.0:
            return None
        share = y * (1.0 - y) * whole
        away = share - around * (1.0 - coupled)  # [S]: sum of w y (1 - y)
        mean = away / whole if away > 0.0 else 0.0  # of the wrap
        if mean > _SEAM_DISTANCE * math.sqrt(around / whole):
            return None
        noise = abs(1.0 - 2.0 * y) * whole * math.sqrt(one.yy / frames) + math.sqrt(
            one.around / frames + sheets.lower_variance
        )
        slack = _SEAM_DEVIATIONS * noise + _SEAM_MODEL_ERROR * around
        mean = 0.5 - math.sqrt(0.25 - mean if mean < 0.25 else 0.0)  # where all are equally far, y (1 - y) is that of y
        beyond = (y - mean) / max(1.0 - 2.0 * mean, 1e-3)  # part of the conductance before the seam, at phi = wrap
        uneven = 1.0 - 2.0 * (0.0 if beyond < 0.0 else 1.0 if beyond > 1.0 else beyond)
        square = uneven * uneven
        far = mean * self._wrap + self._gap  # [rad], from the middle of the seam
        off = uneven * (_OFFSET_1 + square * (_OFFSET_3 + square * _OFFSET_5)) * far  # of the centroid, likewise
        angle = max(0.0, self._angle - abs(off) / self._wrap)  # on the other side of the seam than the centroid
        second = whole if whole < self._limit else self._limit
        doubt = "" if abs(away) + slack < _SEAM_MARGIN * second * angle * (1.0 - angle) else _OVER_SEAM
        return self._centroid(matrix, one, frames, sheets, (mean, far, off), doubt)

    def _coupled(self, x: float, upper: float) -> float:
        """Return the coupling of the two straight edges at equal x through the upper sheet [ohm]."""
        turn, total = math.pi * x, 0.0
        for number, weight in enumerate(self._coupling, 1):
            sine = math.sin(number * turn)
            total += weight * sine * sine
            if weight < 1e-4 * self._coupling[0]:
                break
        return total * self._estimator.breadth / (self._estimator.length * upper)

    def _centroid(
        self,
        matrix: ContactMatrix,
        one: MatrixNoise,
        frames: float,
        sheets: SheetConductances,
        across: tuple[float, float, float],
        doubt: str,
    ) -> SeamPlace:
        """Return the place of contacts by their mean distance from the edges [of the wrap] and from the seam [rad]."""
        mean, far, off = across
        length, breadth = self._estimator.length, self._estimator.breadth
        u, _ = self._estimator.place(matrix.x, matrix.y, 0.0, 0.0)
        phi = off - self._gap
        radius = self._radius_at(u)
        stretch = radius / self._radius_at(0.0)
        share = stretch * stretch / frames
        uu = share * one.xx * length * length + (_ALONG_DEVIATION * far * radius) ** 2
        ss = share * one.yy * breadth * breadth * mean * mean + (_ACROSS_DEVIATION * far * radius) ** 2
        # the side after the seam lies so much further along than the side before it
        ahead = -matrix.cross / (matrix.around - sheets.lower) * length * stretch
        if not doubt:
            along = (matrix.along - sheets.upper) * (length / (DANGEROUS_ANGLE * self._radius_at(0.0))) ** 2
            second = matrix.conductance if matrix.conductance < self._limit else self._limit
            if along > _MAX_ALONG_SHARE * second:
                doubt = _OVER_SEAM
        half = far * radius
        return SeamPlace(
            u,
            phi if phi >= 0.0 else phi + 2.0 * math.pi,
            (uu, 0.0, ss),
            doubt,
            (math.hypot(0.5 * ahead, half), math.atan2(half, 0.5 * ahead) - (math.pi if ahead < 0.0 else 0.0)),
        )

    def end(self) -> None:
        """Forget the touch: it is over."""
        self._before, self._held = None, False

    def interrupt(self) -> None:
        """Note a frame that is no press over the seam: the next one follows no other."""
        self._before = None

    def may_be(self, values: tuple[float, float, float, float, float, float]) -> bool:
        """Tell at little cost whether a touch may be a press over the seam, by the first six of a ``ContactMatrix``."""
        return not values[5] - self._lower < _MIN_SEAM_SHARE * values[0]

    def feed(
        self,
        mean: ContactMatrix,
        noise: MatrixNoise,
        frames: float,
        sheets: SheetConductances,
        conductance: float,
        valid: bool,
    ) -> SeamPlace | None:
        """Return the place of a press over the seam, and why it is not certain. None where it is none.

        Args:
            mean: of the matrices of a touch that may be one.
            noise: of one frame.
            frames: in the mean.
            sheets: without contact.
            conductance: of the newest frame [S].
            valid: the newest frame does not contradict itself.
        """
        seam = self._place(mean, noise, frames, sheets)
        if seam is None:
            self._before = None
            return None
        if self._map is not None:
            wrap = self._map.frustum.wrap
            seam = seam._replace(u=0.5 * (self._map.apply(seam.u, 0.0)[0] + self._map.apply(seam.u, wrap)[0]))
        before, self._before = self._before, seam[:2]
        if not valid:
            return seam._replace(doubt=CONTRADICTS)
        changes = abs(conductance / mean.conductance - 1.0) > _CONDUCTANCE_CHANGE
        return seam._replace(doubt=self._doubt(seam, before, changes))

    def _doubt(self, seam: SeamPlace, before: tuple[float, float] | None, changes: bool) -> str:
        """Return why the place is not certain. Empty where it is."""
        if seam.doubt or before is None or (changes and not self._held):
            self._held = False
            return seam.doubt or MOVES
        self._held = True  # what was excluded once is not doubted again because the press changes
        around = math.remainder(seam.phi - before[1], 2.0 * math.pi) * self._breadth / self._wrap
        return MOVES if (seam.u - before[0]) ** 2 + around * around > self._settle else ""
