"""Leak between the layers of an untouched sensor: learned over quiet frames, taken off what a touch shows.

Damp joins the layers everywhere a little. To the electrodes it is a contact matrix as any contact is, and the matrices
of weak contacts add: conductance, first and second moments. So a touch is what is left of the whole. It is for the
place alone: no threshold is compared with what is left, so that no press is lost by it, however slowly it comes.
"""

from __future__ import annotations

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameInversion
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

__all__ = ["UntouchedLeak"]

LEAK_BLOCK = 32  # frames that are averaged before they are inverted
_LEAK_MEMORY = 16  # blocks that the mean remembers
_MIN_LEAK_LEVEL = 1e-3  # a leak that shows less does nothing to a touch: 5 Mohm with 10 kohm pull-downs
_MIN_LEAK = 1e-7  # S; 10 Mohm are what the converter's own inputs are
_MAX_LEAK_SHARE = 0.5  # of the whole conductance; where the leak is more, a touch is too weak for a place


class UntouchedLeak:
    """The leak of one sensor.

    Args:
        sensor: the sensor.
        largest: conductance that is learned at most [S]; what is more is not a leak.

    Attributes:
        conductance: of the leak [S]; 0 where there is none.
        x: its electrical centre, as in ContactMatrix.
        y: the same around.
    """

    __slots__ = ("_blocks", "_frames", "_inversion", "_largest", "conductance", "x", "y")

    def __init__(self, sensor: Sensor, largest: float) -> None:
        self._inversion = FrameInversion(sensor)
        self._largest = largest
        self._frames: list[Frame] = []
        self._blocks = 0
        self.conductance = self.x = self.y = 0.0

    def skip(self) -> None:
        """Forget the block that was under way: the sensor is not quiet any more."""
        if self._frames:
            self._frames.clear()

    def wants(self, highest: float) -> bool:
        """Tell whether anything is learned from quiet frames with at most this level."""
        return highest >= _MIN_LEAK_LEVEL or bool(self.conductance)

    def feed(self, frame: Frame, level: float) -> None:
        """Take a quiet frame and its level."""
        if level < _MIN_LEAK_LEVEL and not self.conductance:
            return  # a dry sensor, and nothing to learn
        self._frames.append(frame)
        if len(self._frames) >= LEAK_BLOCK:
            self._close()

    def _close(self) -> None:
        sums = [sum(counts) / LEAK_BLOCK for counts in zip(*[frame[6:18] for frame in self._frames], strict=True)]
        mean = Frame._make((*self._frames[-1][:6], *sums, None))
        self._frames.clear()
        matrix = self._inversion.take(mean)
        self._blocks = min(self._blocks + 1, _LEAK_MEMORY)
        share = 1.0 / self._blocks
        if matrix is None or matrix.conductance < _MIN_LEAK:
            self.conductance -= share * self.conductance
            return
        known, seen = (1.0 - share) * self.conductance, share * min(matrix.conductance, self._largest)
        total = known + seen
        self.x, self.y = (known * self.x + seen * matrix.x) / total, (known * self.y + seen * matrix.y) / total
        self.conductance = total

    def take_off(self, matrix: ContactMatrix) -> ContactMatrix:
        """Return the contact matrix of the touch alone.

        The learned untouched currents contain the leak's own part of ``along`` and ``around``; what is taken off here
        is the part of the distance between leak and touch.
        """
        leak, whole = self.conductance, matrix.conductance
        if leak < _MIN_LEAK or leak > _MAX_LEAK_SHARE * whole:
            return matrix
        touch = whole - leak
        off_x, off_y = matrix.x - self.x, matrix.y - self.y
        ratio = leak / touch
        pull = ratio * whole  # G_c G_l/G (X_c - X_l)^2, with X_c - X_l = (X - X_l) G/G_c
        return matrix._replace(
            conductance=touch,
            x=matrix.x + ratio * off_x,
            y=matrix.y + ratio * off_y,
            along=matrix.along - pull * off_x * off_x,
            cross=matrix.cross - pull * off_x * off_y,
            around=matrix.around - pull * off_y * off_y,
        )
