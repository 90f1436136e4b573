"""Filter of the contact matrices of one touch after another: it rests, or moves at a constant velocity.

In information form: sums of the frames, of their times and of their electrical centres, the newest frame at time 0.
They fit a line to the centre. How far the line is believed is the chance that the touch moves and does not rest, by the
frames themselves (a Bayes factor, with a normal prior of the velocity). So at rest the noise of the place falls with
the root of the number of frames, and a sliding touch is not behind itself. A frame that neither explains begins anew.

The covariance is that of the mixture: noise, what is not known of the velocity, and the way within one frame, whose
phases are measured one after the other.
"""

from __future__ import annotations

import math
from typing import Final

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, MatrixNoise

_MEMORY_FRAMES: Final = 128.0  # frames that the sums stand for at most
_SMOOTHING_GAIN: Final = 0.125  # of the distance to the prediction; its variance is 1/15 of a frame's
_SMOOTHED_VARIANCE: Final = _SMOOTHING_GAIN / (2.0 - _SMOOTHING_GAIN)
_MOVED_VARIANCE: Final = 16.0  # four standard deviations, squared: once in 16 000 independent frames by chance
_JUMPED_VARIANCE: Final = 36.0  # six, of one frame alone
_USUAL_SPEED: Final = 0.3  # m/s; standard deviation of the velocity of a touch that moves
_SLOW_PART: Final = 0.01  # of its variance, a slow slide's: the place does not follow it early, its doubt does
_TOLD_CHANCE: Final = 0.999  # chance that it moves, from which on a velocity is told
_PHASE_SKEW: Final = 1.0 / 6.0  # of a frame; standard deviation of the moment at which its place was


class TouchFilter:
    """The filter of one sensor.

    Args:
        length: of the sheet's rectangle along and around, at the wider end [m].

    Attributes:
        frames: that the averages stand for, 1 where it has just begun anew, 0 before the first.
        values: the first six of a ``ContactMatrix``: the centre where it is now, the others averaged.
    """

    def __init__(self, length: tuple[float, float]) -> None:
        self._squares = length[0] * length[0], length[1] * length[1]
        self.restart()

    def restart(self) -> None:
        """Forget all matrices."""
        self.begin(ContactMatrix(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        self.frames = 0

    def begin(self, matrix: ContactMatrix) -> None:
        """Begin with a matrix."""
        g, x, y, along, cross, around, _, _, _ = matrix
        self.frames, self.values = 1, (g, x, y, along, cross, around)
        self._centre = matrix.x, matrix.y, 0.0, 0.0  # the first, and how far predictions were off of late
        self._sums = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # of ages^0, ^1, ^2; of x and y, alone and by age
        self._line = 1.0, 1.0, 0.0, 0.0, 0.0, 0.0  # variances now and one frame ahead, steps, chance, what is unsure

    def mean(self) -> ContactMatrix:
        """Return the values as those of one frame that does not contradict itself."""
        g, x, y, along, cross, around = self.values
        return tuple.__new__(ContactMatrix, (g, x, y, along, cross, around, 0.0, 0.0, 0.0))

    @property
    def share(self) -> float:
        """Variance of the centre over that of one frame, by noise."""
        return self._line[0]

    @property
    def motion(self) -> tuple[float, float, float]:
        """Covariances xx, xy, yy of the centre by motion, as ratios of the sides squared."""
        _, _, step_x, step_y, _, unsure = self._line
        return unsure * step_x * step_x, unsure * step_x * step_y, unsure * step_y * step_y

    @property
    def velocity(self) -> tuple[float, float]:
        """Of the centre [sides per frame]; 0 where it may rest."""
        _, _, step_x, step_y, moves, _ = self._line
        return (step_x, step_y) if moves > _TOLD_CHANCE else (0.0, 0.0)

    def feed(self, matrix: ContactMatrix, noise: MatrixNoise, period: float) -> None:
        """Take the matrix of the next frame.

        Args:
            period: time from frame to frame [s].
        """
        if not self.frames:
            self.begin(matrix)
            return
        new_g, new_x, new_y, new_along, new_cross, new_around, _, _, _ = matrix
        g, x, y, along, cross, around = self.values
        usual = _USUAL_SPEED * period
        usual_x, usual_y = usual * usual / self._squares[0], usual * usual / self._squares[1]
        xx, yy = noise.xx, noise.yy
        _, ahead, step_x, step_y, moves, unsure = self._line
        first_x, first_y, smooth_x, smooth_y = self._centre
        moving_x, moving_y = unsure * step_x * step_x, unsure * step_y * step_y
        if self.frames == 1:
            moving_x, moving_y = usual_x, usual_y
        off_x, off_y = new_x - x - moves * step_x, new_y - y - moves * step_y
        smooth_x += _SMOOTHING_GAIN * (off_x - smooth_x)
        smooth_y += _SMOOTHING_GAIN * (off_y - smooth_y)
        self._centre = first_x, first_y, smooth_x, smooth_y
        alone, smooth = 1.0 + ahead, _SMOOTHED_VARIANCE + ahead
        if (
            off_x * off_x > _JUMPED_VARIANCE * (alone * xx + moving_x)
            or off_y * off_y > _JUMPED_VARIANCE * (alone * yy + moving_y)
            or smooth_x * smooth_x > _MOVED_VARIANCE * (smooth * xx + moving_x)
            or smooth_y * smooth_y > _MOVED_VARIANCE * (smooth * yy + moving_y)
        ):
            self.begin(matrix)
            return
        self._add(new_x - first_x, new_y - first_y)
        place_x, place_y = self._fit(xx, yy, usual_x, usual_y)
        frames = self.frames
        if frames < _MEMORY_FRAMES:
            self.frames = frames = frames + 1
        gain = 1.0 / frames
        self.values = (
            g + gain * (new_g - g),
            place_x,
            place_y,
            along + gain * (new_along - along),
            cross + gain * (new_cross - cross),
            around + gain * (new_around - around),
        )

    def _add(self, x: float, y: float) -> None:
        """Add a centre, as far as it is from the first, at time 0. All others become one frame older."""
        s0, s1, s2, x0, x1, y0, y1 = self._sums
        kept = 1.0 if s0 < _MEMORY_FRAMES - 1.0 else 1.0 - 1.0 / _MEMORY_FRAMES
        s0, s1, s2 = kept * s0 + 1.0, kept * (s1 - s0), kept * (s2 - 2.0 * s1 + s0)
        self._sums = s0, s1, s2, kept * x0 + x, kept * (x1 - x0), kept * y0 + y, kept * (y1 - y0)

    def _fit(self, xx: float, yy: float, usual_x: float, usual_y: float) -> tuple[float, float]:
        """Return the centre now, and note the line that it is on.

        Args:
            xx, yy: noise of one frame's centre.
            usual_x, usual_y: variances of the velocity of what moves [sides per frame].
        """
        s0, s1, s2, x0, x1, y0, y1 = self._sums
        first_x, first_y, _, _ = self._centre
        share = 1.0 / s0
        lag = -s1 * share  # frames from the mean time of them all
        spread = s2 + s1 * lag
        by_noise = 1.0 / spread  # variance of the velocity, over that of one frame
        mean_x, mean_y = x0 * share, y0 * share
        step_x, step_y = (x1 + lag * x0) * by_noise, (y1 + lag * y0) * by_noise
        doubt_x, doubt_y = xx * by_noise, yy * by_noise
        fast_x, fast_y = usual_x / doubt_x, usual_y / doubt_y
        odds = (1.0 + fast_x) * (1.0 + fast_y)
        slow_odds = (1.0 + _SLOW_PART * fast_x) * (1.0 + _SLOW_PART * fast_y)
        seen = step_x * step_x / doubt_x + step_y * step_y / doubt_y
        moves = slides = 1.0
        if seen < 200.0:
            chance = math.exp(-0.5 * seen)
            moves = 1.0 / (1.0 + math.sqrt(odds) * chance)
            slides = 1.0 / (1.0 + math.sqrt(slow_odds) * chance)
        # behind a slide by 1 - moves of its way, ahead of what rests by moves
        unsure = (moves * moves + slides * (1.0 - 2.0 * moves)) * lag * lag + moves * _PHASE_SKEW * _PHASE_SKEW
        ahead = share + moves * (lag + 1.0) * (lag + 1.0) * by_noise
        self._line = share + moves * lag * lag * by_noise, ahead, step_x, step_y, moves, unsure
        return first_x + mean_x + moves * lag * step_x, first_y + mean_y + moves * lag * step_y
