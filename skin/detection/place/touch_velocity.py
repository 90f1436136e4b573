"""Velocity of a touch along the surface: an alpha-beta filter of its electrical centre."""

from __future__ import annotations

import math

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix

from .matrix_noise import MatrixNoise
from .place_estimate import PlaceEstimator

__all__ = ["TouchVelocity"]

_POSITION_REST, _VELOCITY_GAIN = 0.8, 0.02  # critically damped
_VELOCITY_NOISE = 0.035  # of a frame's noise over the period; what the filter leaves
_MIN_VELOCITY_VARIANCE = (5.0 * _VELOCITY_NOISE) ** 2  # five standard deviations, squared; what is less is no velocity
_NO_VELOCITY = (0.0, 0.0)


class TouchVelocity:
    """The velocity of one touch after another.

    Args:
        estimator: of the sheet; says how long and broad it is.
    """

    __slots__ = ("_breadth", "_curvature", "_length", "_track")

    def __init__(self, estimator: PlaceEstimator) -> None:
        self._length, self._breadth, self._curvature = estimator.length, estimator.breadth, estimator.curvature
        self._track: tuple[float, float, float, float] | None = None

    def restart(self) -> None:
        """Forget the touch."""
        self._track = None

    def follow(self, matrix: ContactMatrix, noise: MatrixNoise | None, period: float) -> tuple[float, float]:
        """Return the velocity along the side and around [m/s]; zeros where noise explains what moved.

        Args:
            matrix: of the next frame of the touch.
            noise: of one frame; None: not known yet.
            period: time from frame to frame [s].
        """
        track = self._track
        if track is None or noise is None or not period > 0.0:
            self._track = matrix.x, matrix.y, 0.0, 0.0
            return _NO_VELOCITY
        x, y, step_x, step_y = track
        new_x, new_y = matrix.x, matrix.y
        off_x, off_y = new_x - x - step_x, new_y - y - step_y
        step_x, step_y = step_x + _VELOCITY_GAIN * off_x, step_y + _VELOCITY_GAIN * off_y
        x, y = new_x - _POSITION_REST * off_x, new_y - _POSITION_REST * off_y
        self._track = x, y, step_x, step_y
        if step_x * step_x < _MIN_VELOCITY_VARIANCE * noise.xx and step_y * step_y < _MIN_VELOCITY_VARIANCE * noise.yy:
            return _NO_VELOCITY
        on_sheet = min(max(x, 0.0), 1.0)  # hostile counts put a centre anywhere
        stretch = math.exp(self._curvature * on_sheet * self._length) / period
        return step_x * self._length * stretch, step_y * self._breadth * stretch
