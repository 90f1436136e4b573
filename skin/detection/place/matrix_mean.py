"""Mean of the contact matrices of a touch that rests; it begins anew where the touch moves."""

from __future__ import annotations

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix

from .matrix_noise import MatrixNoise

__all__ = ["MEAN_FRAMES", "MatrixMean"]

MEAN_FRAMES = 128  #: frames; the average reaches back so far
_SMOOTHING_GAIN = 0.125  # of the distance to the mean; its variance is 1/15 of a frame's
_SMOOTHED_VARIANCE = _SMOOTHING_GAIN / (2.0 - _SMOOTHING_GAIN)
_MOVED_VARIANCE = 16.0  # four standard deviations, squared: once in 16 000 independent frames by chance
_JUMPED_VARIANCE = 36.0  # six, of one frame alone


class MatrixMean:
    """The mean of the matrices of one touch after another.

    Attributes:
        frames: in the mean; 1 where it has just begun anew, 0 before the first.
        values: the first six of a ``ContactMatrix``, averaged.
    """

    __slots__ = ("_smooth_x", "_smooth_y", "frames", "values")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all matrices."""
        self.frames = 0
        self.values = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._smooth_x = self._smooth_y = 0.0

    def begin(self, matrix: ContactMatrix) -> None:
        """Begin with the matrix of a frame with which a touch may begin; how far the last ones lay apart is kept."""
        self.frames, self.values = 1, matrix[:6]

    def take(self, matrix: ContactMatrix, noise: MatrixNoise) -> tuple[float, float, float]:
        """Take a matrix into the mean, or begin a new mean with it where the touch has moved; return its G, X, Y.

        Args:
            matrix: of the next frame.
            noise: of one frame.
        """
        frames = self.frames
        g, x, y, along, cross, around = self.values
        new = matrix[:6]
        new_g, new_x, new_y, new_along, new_cross, new_around = new
        if frames:
            off_x, off_y = new_x - x, new_y - y
            smooth_x, smooth_y = self._smooth_x, self._smooth_y
            self._smooth_x = smooth_x = smooth_x + _SMOOTHING_GAIN * (off_x - smooth_x)
            self._smooth_y = smooth_y = smooth_y + _SMOOTHING_GAIN * (off_y - smooth_y)
            share, xx, yy = 1.0 / frames, noise.xx, noise.yy
            alone, smooth = _JUMPED_VARIANCE * (1.0 + share), _MOVED_VARIANCE * (_SMOOTHED_VARIANCE + share)
            if (
                smooth_x * smooth_x > smooth * xx
                or smooth_y * smooth_y > smooth * yy
                or off_x * off_x > alone * xx
                or off_y * off_y > alone * yy
            ):
                frames = 0
        if not frames:
            self.frames, self.values = 1, new
            self._smooth_x = self._smooth_y = 0.0
            return new_g, new_x, new_y
        if frames < MEAN_FRAMES:
            self.frames = frames = frames + 1
        gain = 1.0 / frames
        g, x, y = g + gain * (new_g - g), x + gain * (new_x - x), y + gain * (new_y - y)
        self.values = (
            g,
            x,
            y,
            along + gain * (new_along - along),
            cross + gain * (new_cross - cross),
            around + gain * (new_around - around),
        )
        return g, x, y
