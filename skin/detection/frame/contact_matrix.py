"""Contact matrix: the six numbers that all contacts together are to the four electrodes, out of one frame.

The electrodes impose a difference of the two sheets h0 + hx x/L + hy y/T, with h0 = V_B - V_D, hx = V_A - V_B and
hy = V_D - V_C (docs/understand/field.md). The contacts answer with a conductance G, an electrical centre (X, Y) and a
polarisability P. In each phase, with Ic the current from the upper to the lower sheet and K = (sheets) + P,

    h0 + X hx + Y hy = Ic / G,        K (hx, hy) = (I_A - X Ic, -I_C - Y Ic)

The radial and the angular phase are two such sets, so one 2 x 2 inverse gives X, Y and all of K, exactly, whatever the
leads and the inputs load; G comes from the touch phase. Three equations are left over. They tell whether the frame can
come from two sheets with contacts between them at all.
"""

from __future__ import annotations

from typing import NamedTuple

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

__all__ = ["ContactMatrix", "FrameInversion"]

_MIN_CONDUCTANCE = 1e-9  # S; a conductance below this is none


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
    """The inversion of the frames of one sensor.

    Args:
        sensor: the sensor.
    """

    __slots__ = (
        *("_a", "_a_seen", "_b", "_b_seen", "_c", "_c_over", "_c_seen", "_d", "_d_over", "_d_seen"),
        *("_b_positive", "_c_positive", "_input", "_pulldown", "_unit"),
    )

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

    def take(self, frame: Frame) -> ContactMatrix | None:
        """Work out the contact matrix of a frame; None where nothing joins the sheets, or where they are not driven."""
        lead_a, lead_b, lead_c, lead_d = self._a, self._b, self._c, self._d
        unit, load, pull = self._unit, self._input, self._pulldown
        touch_c, touch_d, touch_current, radial_c, radial_d, radial, angular_a, angular_b, angular = frame[6:15]
        supply0, supply1, supply2 = frame[15:18]
        # potentials as fractions of the supply, currents over it [S]; into the sensor positive
        scale = 1.0 / supply1
        c1, d1, drive = radial_c * scale, radial_d * scale, radial * unit * scale
        ic1 = (c1 + d1) * load
        if self._b_positive:
            v_b, v_a, i_a1 = 1.0 - lead_b * drive, lead_a * (drive - ic1), ic1 - drive
        else:
            v_b, v_a, i_a1 = lead_b * (drive - ic1), 1.0 - lead_a * drive, drive
        v_d = d1 * self._d_seen
        h01, hx1, hy1 = v_b - v_d, v_a - v_b, v_d - c1 * self._c_seen

        scale = 1.0 / supply2
        a2, b2, drive = angular_a * scale, angular_b * scale, angular * unit * scale
        ic2 = -(a2 + b2) * load
        if self._c_positive:
            v_c, v_d, i_c2 = 1.0 - lead_c * drive, lead_d * (drive + ic2), drive
        else:
            v_c, v_d, i_c2 = lead_c * (drive + ic2), 1.0 - lead_d * drive, -drive - ic2
        v_b = b2 * self._b_seen
        h02, hx2, hy2 = v_b - v_d, a2 * self._a_seen - v_b, v_d - v_c

        scale = 1.0 / supply0
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
        return ContactMatrix(
            1.0 / rho if rho > 1e-6 else 1e6,
            x,
            y,
            along,
            cross,
            around,
            cross2 - cross1,
            touch_current * unit * scale - ic0,
            c0 - d0 - (outflow + outflow - ic0) / pull,
        )
