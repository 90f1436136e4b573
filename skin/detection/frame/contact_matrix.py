"""Contact matrix: the six numbers that all contacts together are to the four electrodes, out of one frame.

The electrodes impose a difference of the two sheets h0 + hx x/L + hy y/T, with h0 = V_B - V_D, hx = V_A - V_B and
hy = V_D - V_C (docs/understand/field.md). The contacts answer with a conductance G, an electrical centre (X, Y) and a
polarisability P. In each phase, with Ic the current from the upper to the lower sheet and K = (sheets) + P,

    h0 + X hx + Y hy = Ic / G,        K (hx, hy) = (I_A - X Ic, -I_C - Y Ic)

The radial and the angular phase are two such sets, so one 2 x 2 inverse gives X, Y and all of K, exactly, whatever the
leads and the inputs load. G comes from the touch phase. Three equations are left over. They tell whether the frame can
come from two sheets with contacts between them at all.

The converter's noise in ten counts becomes that of the matrix by differentiating the same equations where they hold:
the inverse that gives the numbers gives their derivatives. The leads enter by the potentials that they leave, not by
the noise of their currents.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTH, Frame

_MIN_CONDUCTANCE: Final = 1e-9  # S; a conductance below this is none


class ContactMatrix(NamedTuple):
    """The contacts of one frame, or of the mean of many, and what the frame says twice.

    Conductances of the sheets and of the contacts' polarisability are not told apart by one frame: the sheets alone
    are what an untouched sensor has.
    """

    conductance: float  #: G, between the sheets, spreading in both included [S]
    x: float  #: electrical centre along the slant, as a fraction of the rectangle's length, from end 1
    y: float  #: electrical centre around, as a fraction of the wrap, from phi = 0
    along: float  #: of the upper sheet and P_xx [S]
    cross: float  #: P_xy [S], the mean of what the two phases say, each weighed by its noise
    around: float  #: of the lower sheet and P_yy [S]
    reciprocity: float  #: P_xy of the angular phase minus that of the radial one [S]: 0
    sum_rule: float  #: drive current of the touch phase less what flows through the pull-downs, over the supply [S]: 0
    split: float  #: difference of the two guides of the touch phase, less what the six numbers say, of the supply: 0


class FrameInversion:
    """The inversion of the frames of one sensor."""

    def __init__(self, sensor: Sensor) -> None:
        parts = sensor.electronics
        self._a, self._b, self._c, self._d = parts.lead_ohms
        self._input, self._pulldown = 1.0 / parts.input_ohms, 1.0 / parts.pulldown_ohms
        self._unit = parts.current_full_scale / parts.adc_volts  # siemens for a count of current over a count of supply
        # potential of an electrode over its reading: the input draws a current, in the touch phase the pull-down does
        self._a_seen, self._b_seen, self._c_seen, self._d_seen = (1.0 + lead * self._input for lead in parts.lead_ohms)
        self._c_over, self._d_over = 1.0 + self._c * self._pulldown, 1.0 + self._d * self._pulldown
        self._b_positive, self._c_positive = sensor.b_positive, sensor.c_positive

    def untouched(self, radial: float, angular: float) -> tuple[float, float]:
        """Return the conductances of the upper and the lower sheet alone [S].

        Args:
            radial: drive current of the radial phase without contact over the supply [counts over counts].
            angular: that of the angular phase.
        """
        upper, lower = radial * self._unit, angular * self._unit
        return upper / (1.0 - (self._a + self._b) * upper), lower / (1.0 - (self._c + self._d) * lower)

    def invert(self, counts: Sequence[float]) -> ContactMatrix | None:
        """Work out the contact matrix. None where nothing joins the sheets, or where they are not driven.

        Args:
            counts: fields ``touch_c`` to ``angular_supply`` of a frame, or their means over several frames.
        """
        lead_a, lead_b, lead_c, lead_d = self._a, self._b, self._c, self._d
        unit, load, pull = self._unit, self._input, self._pulldown
        touch_c, touch_d, touch, radial_c, radial_d, radial, angular_a, angular_b, angular, rail0, rail1, rail2 = counts
        # potentials as fractions of the supply, currents over it [S]; into the sensor positive
        scale = 1.0 / rail1
        c1, d1, drive = radial_c * scale, radial_d * scale, radial * unit * scale
        ic1 = (c1 + d1) * load
        if self._b_positive:
            v_b, v_a, i_a1 = 1.0 - lead_b * drive, lead_a * (drive - ic1), ic1 - drive
        else:
            v_b, v_a, i_a1 = lead_b * (drive - ic1), 1.0 - lead_a * drive, drive
        v_d = d1 * self._d_seen
        h01, hx1, hy1 = v_b - v_d, v_a - v_b, v_d - c1 * self._c_seen

        scale = 1.0 / rail2
        a2, b2, drive = angular_a * scale, angular_b * scale, angular * unit * scale
        ic2 = -(a2 + b2) * load
        if self._c_positive:
            v_c, v_d, i_c2 = 1.0 - lead_c * drive, lead_d * (drive + ic2), drive
        else:
            v_c, v_d, i_c2 = lead_c * (drive + ic2), 1.0 - lead_d * drive, -drive - ic2
        v_b = b2 * self._b_seen
        h02, hx2, hy2 = v_b - v_d, a2 * self._a_seen - v_b, v_d - v_c

        scale = 1.0 / rail0
        c0, d0 = touch_c * scale, touch_d * scale
        ic0 = (c0 + d0) * pull
        determinant = hx1 * hy2 - hy1 * hx2
        if ic0 < _MIN_CONDUCTANCE or -1e-3 < determinant < 1e-3:
            return None
        inverse = 1.0 / determinant
        xx, xy, yx, yy = hy2 * inverse, -hy1 * inverse, -hx2 * inverse, hx1 * inverse
        v_d = d0 * self._d_over
        hy0 = v_d - c0 * self._c_over
        x0, y0 = -xx * h01 - xy * h02, -yx * h01 - yy * h02
        x1, y1 = xx * ic1 + xy * ic2, yx * ic1 + yy * ic2
        # 1/G = (h0 + X hx + Y hy)/Ic, and X and Y hold 1/G themselves; at first without the leads of A and B
        rho = (1.0 - v_d + y0 * hy0) / (ic0 - y1 * hy0)
        x, y = x0 + rho * x1, y0 + rho * y1
        p1, p2, q1, q2 = i_a1 - x * ic1, -a2 * load - x * ic2, c1 * load - y * ic1, -i_c2 - y * ic2
        along, cross2 = xx * p1 + xy * p2, yx * p1 + yy * p2
        cross1, around = xx * q1 + xy * q2, yx * q1 + yy * q2
        i_a0 = (x * ic0 + cross2 * hy0 + along * lead_b * ic0) / (1.0 + along * (lead_a + lead_b))
        drop = lead_b * (ic0 - i_a0)
        hx0 = drop - lead_a * i_a0
        rho = (1.0 - drop - v_d + x0 * hx0 + y0 * hy0) / (ic0 - x1 * hx0 - y1 * hy0)
        x, y = x0 + rho * x1, y0 + rho * y1
        # the noise of each is a guide's over the sheet that it lies in
        weight1, weight2 = along * along, around * around
        if weight1 + weight2 < _MIN_CONDUCTANCE * _MIN_CONDUCTANCE:
            return None  # no sheet conducts: nothing drives them in the radial and the angular phase
        cross = (weight1 * cross1 + weight2 * cross2) / (weight1 + weight2)
        # c0 pull = -I_C and d0 pull = -I_D = Ic + I_C
        outflow = cross * hx0 + around * hy0 + y * ic0
        values = (
            1.0 / rho if rho > 1e-6 else 1e6,
            x,
            y,
            along,
            cross,
            around,
            cross2 - cross1,
            touch * unit * scale - ic0,
            c0 - d0 - (outflow + outflow - ic0) / pull,
        )
        return tuple.__new__(ContactMatrix, values)  # quicker than ContactMatrix()


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


class FrameNoise:
    """The noise of the frames of one sensor."""

    def __init__(self, sensor: Sensor) -> None:
        parts = sensor.electronics
        self._unit = parts.current_full_scale / parts.adc_volts
        self._input = 1.0 / parts.input_ohms
        lead_a, lead_b, lead_c, lead_d = parts.lead_ohms
        self._radial_leads, self._angular_leads = lead_a + lead_b, lead_c + lead_d
        self._b_positive, self._c_positive = sensor.b_positive, sensor.c_positive

    def of(self, matrix: ContactMatrix, frame: Frame, variance: float) -> MatrixNoise:
        """Return the noise of a frame's matrix.

        Args:
            matrix: of the frame, or the mean of some like it.
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
        near1, far1, near2, far2 = y + load, 1.0 - y + load, x + load, 1.0 - x + load
        guides1, guides2 = noise * (near1 * near1 + far1 * far1), noise * (near2 * near2 + far2 * far2)
        split1, split2 = 2.0 * around * around * noise, 2.0 * along * along * noise
        # the supply in the same equations: in the first of each pair by the radial phase's, in the second the angular's
        supply1, supply2 = (1.0 - x if self._b_positive else x), (-y if self._c_positive else y - 1.0)
        x_1, x_2, y_1, y_2 = i1 * supply1, mix1 * supply2, mix2 * supply1, i2 * supply2
        a_1, a_2 = i1 * along * sign1, mix1 * cross * sign2
        r_1, r_2 = mix2 * cross * sign1, i2 * around * sign2
        if frame.length == FRAME_LENGTH:  # one supply for both phases
            x_1, y_1, a_1, r_1, x_2, y_2, a_2, r_2 = x_1 + x_2, y_1 + y_2, a_1 + a_2, r_1 + r_2, 0.0, 0.0, 0.0, 0.0
        weight1, weight2 = along * along, around * around
        weight1, weight2 = weight1 / (weight1 + weight2), weight2 / (weight1 + weight2)
        i11, i22, m11, m22 = i1 * i1, i2 * i2, mix1 * mix1, mix2 * mix2
        both1, both2 = around * noise * (2.0 * y - 1.0), along * noise * (2.0 * x - 1.0)
        values = (
            i11 * guides1 + m11 * guides2 + noise * (x_1 * x_1 + x_2 * x_2),
            i1 * mix2 * guides1 + mix1 * i2 * guides2 + noise * (x_1 * y_1 + x_2 * y_2),
            m22 * guides1 + i22 * guides2 + noise * (y_1 * y_1 + y_2 * y_2),
            i11 * current + m11 * split2 + noise * (a_1 * a_1 + a_2 * a_2),
            weight1 * weight1 * (i11 * split1 + m11 * current) + weight2 * weight2 * (m22 * current + i22 * split2),
            m22 * split1 + i22 * current + noise * (r_1 * r_1 + r_2 * r_2),
            noise * (a_1 * r_1 + a_2 * r_2),
            m11 * both2 + noise * (x_1 * a_1 + x_2 * a_2),
            i1 * mix2 * both1 + noise * (x_1 * r_1 + x_2 * r_2),
            i2 * mix1 * both2 + noise * (y_1 * a_1 + y_2 * a_2),
            m22 * both1 + noise * (y_1 * r_1 + y_2 * r_2),
        )
        return tuple.__new__(MatrixNoise, values)
