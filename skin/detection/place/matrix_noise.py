"""Noise of a contact matrix: what the converter's noise in ten counts does to its numbers.

The three equations of each phase (`contact_matrix`) are differentiated where they hold; the inverse that gives the
numbers gives their derivatives. The leads enter by the potentials that they leave, not by the noise of their currents.
"""

from __future__ import annotations

from typing import NamedTuple

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

__all__ = ["FrameNoise", "MatrixNoise"]


class MatrixNoise(NamedTuple):
    """Variances and covariances of the numbers of one frame's contact matrix."""

    xx: float  #: of X
    xy: float
    yy: float  #: of Y
    along: float  #: [S^2]
    cross: float  #: [S^2]
    around: float  #: [S^2]
    along_around: float  #: [S^2]
    x_along: float  #: [S]
    x_around: float
    y_along: float
    y_around: float
    reciprocity: float  #: [S^2]
    sum_rule: float  #: [S^2]
    split: float


class FrameNoise:
    """The noise of the frames of one sensor.

    Args:
        sensor: the sensor.
    """

    __slots__ = ("_angular_leads", "_b_positive", "_c_positive", "_input", "_pulldown", "_radial_leads", "_unit")

    def __init__(self, sensor: Sensor) -> None:
        parts = sensor.electronics
        self._unit = parts.current_full_scale / parts.adc_volts
        self._pulldown, self._input = 1.0 / parts.pulldown_ohms, 1.0 / parts.input_ohms
        lead_a, lead_b, lead_c, lead_d = parts.lead_ohms
        self._radial_leads, self._angular_leads = lead_a + lead_b, lead_c + lead_d
        self._b_positive, self._c_positive = sensor.b_positive, sensor.c_positive

    def of(self, matrix: ContactMatrix, frame: Frame, variance: float) -> MatrixNoise:
        """Return the noise of a frame's matrix.

        Args:
            matrix: of the frame, or the mean of some like it.
            frame: the frame.
            variance: of each count, its rounding included [counts^2].
        """
        x, y, along, cross, around = matrix.x, matrix.y, matrix.along, matrix.cross, matrix.around
        scale = 1.0 / frame.radial_supply  # the supplies differ by less than their noise matters
        noise = variance * scale * scale
        current = self._unit * self._unit * noise
        sign1, sign2 = -1.0 if self._b_positive else 1.0, -1.0 if self._c_positive else 1.0
        # the inverse: its diagonal, and what the guides' differences mix in
        i1 = sign1 / (1.0 - self._radial_leads * self._unit * frame.radial_current * scale)
        i2 = sign2 / (1.0 - self._angular_leads * self._unit * frame.angular_current * scale)
        mix1 = (frame.radial_c - frame.radial_d) * scale * i1 * i2
        mix2 = (frame.angular_b - frame.angular_a) * scale * i1 * i2
        # the guides in the equations of the centre and of the sheets, and both in one
        load = self._input / matrix.conductance  # what a guide's input draws through the contact
        guides1 = noise * ((y + load) ** 2 + (1.0 - y + load) ** 2)
        guides2 = noise * ((x + load) ** 2 + (1.0 - x + load) ** 2)
        split1, split2 = 2.0 * around * around * noise, 2.0 * along * along * noise
        # the supply in the same equations: in the first of each pair by the radial phase's, in the second the angular's
        supply1, supply2 = (1.0 - x if self._b_positive else x), (-y if self._c_positive else y - 1.0)
        x_1, x_2, y_1, y_2 = i1 * supply1, mix1 * supply2, mix2 * supply1, i2 * supply2
        a_1, a_2 = i1 * along * sign1, mix1 * cross * sign2
        r_1, r_2 = mix2 * cross * sign1, i2 * around * sign2
        if frame.version == 1:  # one supply for both phases
            x_1, y_1, a_1, r_1, x_2, y_2, a_2, r_2 = x_1 + x_2, y_1 + y_2, a_1 + a_2, r_1 + r_2, 0.0, 0.0, 0.0, 0.0
        weight1, weight2 = along * along, around * around
        weight1, weight2 = weight1 / (weight1 + weight2), weight2 / (weight1 + weight2)
        i11, i22, m11, m22 = i1 * i1, i2 * i2, mix1 * mix1, mix2 * mix2
        both1, both2 = around * noise * (2.0 * y - 1.0), along * noise * (2.0 * x - 1.0)
        yy = m22 * guides1 + i22 * guides2 + noise * (y_1 * y_1 + y_2 * y_2)
        rr = m22 * split1 + i22 * current + noise * (r_1 * r_1 + r_2 * r_2)
        total = (frame.touch_c + frame.touch_d) * scale
        share = around / self._pulldown  # of the touch phase's difference between the guides, seen by the lower sheet
        apart = (frame.touch_c - frame.touch_d) * scale / self._pulldown
        return MatrixNoise(
            i11 * guides1 + m11 * guides2 + noise * (x_1 * x_1 + x_2 * x_2),
            i1 * mix2 * guides1 + mix1 * i2 * guides2 + noise * (x_1 * y_1 + x_2 * y_2),
            yy,
            i11 * current + m11 * split2 + noise * (a_1 * a_1 + a_2 * a_2),
            weight1 * weight1 * (i11 * split1 + m11 * current) + weight2 * weight2 * (m22 * current + i22 * split2),
            rr,
            noise * (a_1 * r_1 + a_2 * r_2),
            m11 * both2 + noise * (x_1 * a_1 + x_2 * a_2),
            i1 * mix2 * both1 + noise * (x_1 * r_1 + x_2 * r_2),
            i2 * mix1 * both2 + noise * (y_1 * a_1 + y_2 * a_2),
            m22 * both1 + noise * (y_1 * r_1 + y_2 * r_2),
            i11 * split1 + m11 * current + m22 * current + i22 * split2,
            current + 2.0 * self._pulldown * self._pulldown * noise,
            4.0 * noise * ((1.0 - y + share) ** 2 + (y + share) ** 2) + 4.0 * (total * total * yy + apart * apart * rr),
        )
