"""Wires of a sheet: from the four tabs to one connector beside the rim, with strain relief on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.electrode_layout import SheetLayout
from coneskin.geometry.drawing.surface_shape import ShapeTab

__all__ = ["CableExit", "SheetWire", "cable_exit"]

#: wire that lies on the tab, stripped; in the connector's contact; and the loop behind the strain relief [m]
STRIPPED, IN_CONTACT, LOOP = 8e-3, 4e-3, 20e-3
_ROUND_TO = 5e-3  # m; wires are cut to multiples of it
_TIE_SHARE = 0.5  # of the way from the rim to the connector: where the wires are tied to the link
_LEAST, _MOST = 0.03, 2.0  # m; from the rim to the connector


@dataclass(frozen=True, slots=True)
class SheetWire:
    """One wire.

    Attributes:
        electrode: A, B, C or D.
        pin: of the connector, from 1.
        u: of the middle of the tab's foot, or where there is no tab, of the foil at the rim [m].
        phi: the same [rad].
        length: to be cut [m].
    """

    electrode: str
    pin: int
    u: float
    phi: float
    length: float


@dataclass(frozen=True, slots=True)
class CableExit:
    """Where the wires leave the sheet.

    Attributes:
        side: of the sheet.
        u: of the middle of the four tabs [m].
        phi: the same [rad], in [0, 2 pi): on a full wrap it lies beside the seam.
        tie: distance of the strain relief from the rim, away from the sheet [m].
        connector: the same of the connector [m].
        wires: one for each electrode, in the order of the pins.
    """

    side: str
    u: float
    phi: float
    tie: float
    connector: float
    wires: tuple[SheetWire, ...]


def cable_exit(layout: SheetLayout, connector: float = 0.06) -> CableExit:
    """Lead the wires of a sheet to one connector.

    Args:
        layout: of the sheet.
        connector: distance of the connector from the rim [m].

    Raises:
        GeometryError: that distance is out of range.
    """
    if not _LEAST <= connector <= _MOST:
        raise GeometryError(
            f"the connector must be {_LEAST * 1e3:g} to {_MOST * 1e3:g} mm from the rim, got {connector * 1e3:.4g} mm"
        )
    sheet, side = layout.sheet, layout.plan.wires
    feet = {name: _foot(layout, name) for name in "ABCD"}
    if side.startswith("end"):
        # around the link by the shorter way, which on a full wrap crosses the seam
        u = next(iter(feet.values()))[0]
        middle = math.atan2(*(math.fsum(f(phi) for _, phi in feet.values()) for f in (math.sin, math.cos)))
        exit_at = (u, middle % (2.0 * math.pi))
        ways = {
            name: abs(math.remainder(phi - middle, 2.0 * math.pi)) * sheet.radius_at(u)
            for name, (_, phi) in feet.items()
        }
    else:
        middle = math.fsum(u for u, _ in feet.values()) / 4.0
        exit_at = (middle, feet["A"][1])
        ways = {name: abs(u - middle) for name, (u, _) in feet.items()}
    wires = tuple(
        SheetWire(name, pin, *feet[name], _cut(STRIPPED + ways[name] + connector + LOOP + IN_CONTACT))
        for pin, name in enumerate("ABCD", 1)
    )
    return CableExit(side, *exit_at, _TIE_SHARE * connector, connector, wires)


def _foot(layout: SheetLayout, name: str) -> tuple[float, float]:
    """Return the place at the rim where an electrode is reached."""
    tab = next((step for step in layout.foils[name] if isinstance(step, ShapeTab)), None)
    if tab is not None:
        return tab.u, tab.phi
    sheet, side = layout.sheet, layout.plan.wires
    corners = layout.foils[name]
    if side.startswith("end"):
        u = 0.0 if side == "end1" else sheet.slant
        nearest = min(abs(corner.u - u) for corner in corners)
        near = [corner.phi for corner in corners if abs(corner.u - u) <= nearest + 1e-9]
        return u, min(near, key=lambda phi: abs(math.remainder(phi, 2.0 * math.pi)))  # beside the seam
    phi = 0.0 if side == "edge0" else sheet.wrap
    nearest = min(abs(corner.phi - phi) for corner in corners)
    near = [corner.u for corner in corners if abs(corner.phi - phi) <= nearest + 1e-9]
    return min(near), phi


def _cut(length: float) -> float:
    return math.ceil(length / _ROUND_TO - 1e-9) * _ROUND_TO
