"""Decode a contact without its area error, from electrical data only.

The excess of the drive currents over their values without contact and the split of the guide pairs are the
polarisability of the contact, P_xx, P_yy, P_xy: a dipole, of whatever shape. Its images displace the electrical
centre (X, Y) by

    displacement = -1/2 A grad gamma - (Ru+Rl) kappa/(4 pi) (2 A_xx - A_yy, 3 A_xy),   A = (P_xx L^2, P_xy L T, P_yy
    T^2)

in the rectangle, where gamma is the Robin function there and the second term is the taper. Neither the radius nor the
conductance nor the shape is needed. Plain floats, no arrays: the live chain may call it for every frame.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from .field_robin import Robin

if TYPE_CHECKING:
    from .field_model import FieldModel

__all__ = ["Centre", "Decoder", "Place", "centre"]


class Centre(NamedTuple):
    """The electrical centre of all contact.

    Attributes:
        x: fraction of the log-scaled slant L, from end 1.
        y: fraction of the wrap, from the edge phi=0.
    """

    x: float
    y: float


class Place(NamedTuple):
    """A decoded contact.

    Attributes:
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        moved: length of the correction in the flat sheet [m].
    """

    u: float
    phi: float
    moved: float


def centre(radial_c: float, radial_d: float, angular_a: float, angular_b: float, supply: float) -> Centre:
    """Electrical centre from the guides of both phases, each pair read at the place of the contact.

    A contact drives a little current through the guide sheet too, so its pair differs, and reads the contact's
    potential only at the contact: V_D + (V_C - V_D) Y = U0 (1 - X) and V_B + (V_A - V_B) X = U0 Y, two linear
    equations.

    Args:
        radial_c: potential of C in the radial phase (B at the supply, A at 0) [V].
        radial_d: potential of D in the radial phase [V].
        angular_a: potential of A in the angular phase (C at the supply, D at 0) [V].
        angular_b: potential of B in the angular phase [V].
        supply: U0 [V].
    """
    apart1, apart2 = (radial_c - radial_d) / supply, (angular_a - angular_b) / supply
    v_d, v_b = radial_d / supply, angular_b / supply
    x = (1.0 - v_d - apart1 * v_b) / (1.0 + apart1 * apart2)
    return Centre(x, v_b + apart2 * x)


class Decoder:
    """Compensated decode for one sensor.

    Args:
        model: its sheet and sheet resistances.
        passes: fixed-point passes; three leave less than the dipole model itself does.
    """

    __slots__ = ("_arc", "_curvature", "_length", "_lower", "_passes", "_robin", "_taper", "_upper", "_wrap")

    def __init__(self, model: FieldModel, passes: int = 3) -> None:
        sheet = model.sheet
        self._robin = Robin(sheet, model.upper_resistance, model.lower_resistance)
        self._length, self._arc, self._wrap = sheet.length, sheet.arc, sheet.wrap
        self._curvature = sheet.curvature
        self._taper = (model.upper_resistance + model.lower_resistance) * sheet.curvature / (4.0 * math.pi)
        self._upper = sheet.breadth / (model.upper_resistance * sheet.length)
        self._lower = sheet.length / (model.lower_resistance * sheet.breadth)
        self._passes = passes

    def plain(self, at: Centre) -> Place:
        """The electrical centre itself, as the paper's equations 20 and 24 decode it."""
        return Place(self._slant(at.x * self._length), at.y * self._wrap, 0.0)

    def decode(
        self,
        radial_c: float,
        radial_d: float,
        angular_a: float,
        angular_b: float,
        radial_excess: float,
        angular_excess: float,
        supply: float,
    ) -> Place:
        """Where the contact is.

        Args:
            radial_c: potential of C in the radial phase [V].
            radial_d: potential of D in the radial phase [V].
            angular_a: potential of A in the angular phase [V].
            angular_b: potential of B in the angular phase [V].
            radial_excess: drive current of the radial phase minus that without contact [A].
            angular_excess: drive current of the angular phase minus that without contact [A].
            supply: U0 [V].
        """
        at = centre(radial_c, radial_d, angular_a, angular_b, supply)
        apart1, apart2 = (radial_c - radial_d) / supply, (angular_a - angular_b) / supply
        # P_xy appears in both phases; its products with the splits are corrections of second order.
        xx, yy = radial_excess / supply, angular_excess / supply
        xy = 0.5 * (apart2 * (self._upper + xx) - apart1 * (self._lower + yy))
        xx, yy = xx - xy * apart1, yy + xy * apart2
        length, arc = self._length, self._arc
        a_xx, a_xy, a_yy = xx * length * length, xy * length * arc, yy * arc * arc
        taper_x, taper_y = self._taper * (2.0 * a_xx - a_yy), 3.0 * self._taper * a_xy
        seen_x, seen_y = at.x * length, at.y * arc
        # Far outside, as after a broken wire, there is nothing to correct.
        if not (0.0 < at.x < 1.0 and 0.0 < at.y < 1.0):
            return self.plain(at)
        x, y = seen_x, seen_y
        margin_x, margin_y = 1e-6 * length, 1e-6 * arc
        for _ in range(self._passes):
            gx, gy = self._robin.gradient(x, length - x, y, arc - y)
            x = min(max(seen_x + 0.5 * (a_xx * gx + a_xy * gy) + taper_x, margin_x), length - margin_x)
            y = min(max(seen_y + 0.5 * (a_xy * gx + a_yy * gy) + taper_y, margin_y), arc - margin_y)
        moved = math.hypot(x - seen_x, y - seen_y) * math.exp(self._curvature * x)
        return Place(self._slant(x), y * (self._wrap / arc), moved)

    def _slant(self, x: float) -> float:
        return x if self._curvature == 0.0 else math.expm1(self._curvature * x) / self._curvature
