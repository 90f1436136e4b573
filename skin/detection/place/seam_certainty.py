"""Certainty of a press over the seam, frame after frame: it has to rest, and its conductance with it."""

from __future__ import annotations

import math

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor

from .doubt import CONTRADICTS, MOVES
from .matrix_noise import MatrixNoise
from .place_estimate import PlaceEstimator, SheetConductances
from .seam_contact import SeamPlace, SeamTest

__all__ = ["SeamCertainty"]

_MIN_SEAM_SHARE = 0.02  # P_yy over G; a press over the seam has more, and most touches are told from one by this alone
_CONDUCTANCE_CHANGE = 0.05  # ratio by which the conductance may differ from its mean


class SeamCertainty:
    """The presses over the seam of one sensor.

    Args:
        sensor: the sensor.
        settings: how far a place may move while it is certain, and the weakest second contact.
        estimator: of its places.
        breadth: of the wrap at the wider end [m].

    Attributes:
        closes: the wrap closes, so that one body can press on both edges.
    """

    __slots__ = ("_breadth", "_held", "_lower", "_map", "_place", "_settle", "_test", "_wrap", "closes")

    def __init__(self, sensor: Sensor, settings: DetectorSettings, estimator: PlaceEstimator, breadth: float) -> None:
        self._test = SeamTest(sensor, settings, estimator)
        self.closes = self._test.closes
        self._map, self._lower = sensor.place_map, estimator.sheets[1]
        self._settle = settings.settle_distance**2
        self._breadth, self._wrap = breadth, sensor.frustum.wrap
        self._place: tuple[float, float] | None = None  # of the frame before
        self._held = False  # its place was certain

    def end(self) -> None:
        """Forget the touch: it is over."""
        self._place, self._held = None, False

    def interrupt(self) -> None:
        """Note a frame that is no press over the seam: the next one follows no other."""
        self._place = None

    def may_be(self, values: tuple[float, float, float, float, float, float]) -> bool:
        """Tell at little cost whether a touch may be a press over the seam.

        Args:
            values: the first six of a ``ContactMatrix``.
        """
        return not values[5] - self._lower < _MIN_SEAM_SHARE * values[0]

    def follow(
        self,
        mean: ContactMatrix,
        noise: MatrixNoise,
        frames: float,
        sheets: SheetConductances,
        conductance: float,
        valid: bool,
    ) -> SeamPlace | None:
        """Return the place of a press over the seam, and why it is not certain; None where it is none.

        Args:
            mean: of the matrices of a touch that may be one.
            noise: of one frame.
            frames: in the mean.
            sheets: without contact.
            conductance: of the newest frame [S].
            valid: the newest frame does not contradict itself.
        """
        seam = self._test.place(mean, noise, frames, sheets)
        if seam is None:
            self._place = None
            return None
        if self._map is not None:
            wrap = self._map.frustum.wrap
            seam = seam._replace(u=0.5 * (self._map.apply(seam.u, 0.0)[0] + self._map.apply(seam.u, wrap)[0]))
        before, self._place = self._place, seam[:2]
        if not valid:
            return seam._replace(doubt=CONTRADICTS)
        changes = abs(conductance / mean.conductance - 1.0) > _CONDUCTANCE_CHANGE
        return seam._replace(doubt=self._doubt(seam, before, changes))

    def _doubt(self, seam: SeamPlace, before: tuple[float, float] | None, changes: bool) -> str:
        """Return why the place is not certain; empty where it is."""
        if seam.doubt or before is None or (changes and not self._held):
            self._held = False
            return seam.doubt or MOVES
        self._held = True  # what was excluded once is not doubted again because the press changes
        around = math.remainder(seam.phi - before[1], 2.0 * math.pi) * self._breadth / self._wrap
        return MOVES if (seam.u - before[0]) ** 2 + around * around > self._settle else ""
