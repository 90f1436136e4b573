"""Labels on the parts of a sensor, as large as they fit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from coneskin.geometry.frustum import Frustum

from .electrode_layout import SheetLayout, SurfaceRectangle
from .surface_shape import ShapeCorner, drawing_point

#: height of a capital letter of Helvetica [em]
CAP_HEIGHT = 0.718
#: widths of Helvetica from space to tilde [em / 1000] (Adobe core 14 metrics)
_LETTER_WIDTHS = (
    "278 278 355 556 556 889 667 191 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 278 278 "
    "584 584 584 556 1015 667 667 722 722 667 611 778 722 278 500 667 556 833 722 778 667 778 722 667 611 722 667 944 "
    "667 667 611 278 278 278 469 556 333 556 556 500 556 556 278 556 556 222 222 500 222 833 556 556 556 556 333 500 "
    "278 556 500 722 500 500 500 334 260 334 584"
)
_EM_WIDTHS = tuple(int(width) / 1000.0 for width in _LETTER_WIDTHS.split())
_MAX_HEIGHT = 5e-3  # m, of capitals
_MIN_HEIGHT = 1.2e-3  # m, of capitals; smaller text cannot be read
_LINE_PITCH = 1.7  # from one line to the next, in heights of capitals


@dataclass(frozen=True, slots=True)
class PartLabel:
    """A line of text, centred on a point."""

    text: str  #: plain ASCII
    x: float  #: of the centre [m]
    y: float  #: of the centre [m]
    height: float  #: of capitals [m]
    angle: float = 0.0  #: of the line [rad], counter-clockwise

    @property
    def width(self) -> float:
        """Length of the line in Helvetica [m]."""
        return sum(_EM_WIDTHS[ord(letter) - 32] for letter in self.text) * self.height / CAP_HEIGHT

    def mirrored(self) -> PartLabel:
        """Return the label at its place on the mirrored part, itself not mirrored."""
        return replace(self, x=-self.x, angle=-self.angle)

    def corners(self) -> Iterator[tuple[float, float]]:
        """Yield the four corners of the box of the label [m]."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        for a in (-0.5 * self.width, 0.5 * self.width):
            for b in (-0.5 * self.height, 0.5 * self.height):
                yield self.x + a * c - b * s, self.y + a * s + b * c


def part_labels(
    layout: SheetLayout,
    surface: Frustum,
    lines: tuple[str, ...],
    clear: SurfaceRectangle | None = None,
    ends: tuple[str, ...] = ("END 1 (B)", "END 2 (A)"),
) -> tuple[PartLabel, ...]:
    """Place a block of lines in the middle of a sheet, and the names of its four sides.

    Args:
        surface: the cone for which the sheet is cut.
        lines: lines of the block, the most important first; the last ones are left out if all would be too small.
        clear: part of the sheet in which the block has to lie; by default the active area.
    """
    room = layout.active
    free = clear or room
    phi = 0.5 * (free.phi1 + free.phi2)
    height = _MAX_HEIGHT
    while height >= _MIN_HEIGHT:
        sides = tuple(_sides(layout, surface, 0.6 * height, ends))
        block = _block(surface, 0.5 * (free.u1 + free.u2), phi, lines, height)
        inner = _shrunk(surface, free, 0.5 * height if clear else 2.0 * height)
        if all(_inside(surface, inner, label) for label in block) and all(
            _inside(surface, room, label) for label in sides
        ):
            return block + sides
        height *= 0.93
    return part_labels(layout, surface, lines[:-1], clear, ends) if len(lines) > 1 else ()


def strip_label(layout: SheetLayout, surface: Frustum, which: str, face: str, title: str = "") -> tuple[PartLabel, ...]:
    """Place the name of an electrode, its face and the title along its strip, if the strip is straight enough.

    Args:
        surface: the cone for which the foil is cut.
        which: the electrode, A, B, C or D.
        face: the face that is up.
        title: of the sheet; left out where it does not fit.
    """
    plan, field = layout.plan, layout.field
    half = 0.5 * plan.electrode
    narrow = min(layout.sheet.radius1, layout.sheet.radius2)
    u, phi = layout.electrode_middle(which, 0.5 * (field.u1 + field.u2), 0.5 * (field.phi1 + field.phi2))
    pad = 0.08 * plan.electrode
    turn = pad / narrow
    # along its strip a foil ends before the rim, and before the lead of its neighbour
    corners = [corner for corner in layout.foils[which] if isinstance(corner, ShapeCorner)]
    along = [corner.phi if which in "AB" else corner.u for corner in corners]
    first, last = min(along) + (turn if which in "AB" else pad), max(along) - (turn if which in "AB" else pad)
    strip = {
        "A": SurfaceRectangle(field.u2 + pad, field.u2 + 2.0 * half - pad, first, last),
        "B": SurfaceRectangle(field.u1 - 2.0 * half + pad, field.u1 - pad, first, last),
        "C": SurfaceRectangle(first, last, field.phi2 + turn, field.phi2 + 2.0 * half / narrow - turn),
        "D": SurfaceRectangle(first, last, field.phi1 - 2.0 * half / narrow + turn, field.phi1 - turn),
    }[which]
    full = f"{which} - {face.upper()} FACE UP"
    titled = [(f"{full} - {title}", _MIN_HEIGHT)] if title else []
    for text, least in (*titled, (full, _MIN_HEIGHT), (which, 0.2e-3)):
        height = min(3e-3, 0.6 * plan.electrode)
        while height >= least:
            label = _label(surface, text, u, phi, height, along_edge=which in "CD")
            if _inside(surface, strip, label):
                return (label,)
            height *= 0.9
    return ()


def _sides(layout: SheetLayout, surface: Frustum, height: float, ends: tuple[str, ...]) -> Iterator[PartLabel]:
    room = layout.active
    u, phi = 0.5 * (room.u1 + room.u2), 0.5 * (room.phi1 + room.phi2)
    degrees = math.degrees(surface.wrap)
    yield _label(surface, ends[0], room.u1 + height, phi, height)
    yield _label(surface, ends[1], room.u2 - height, phi, height)
    for text, edge, inward in (("EDGE 0 (D)", room.phi1, 1.0), (f"EDGE {degrees:.4g} (C)", room.phi2, -1.0)):
        yield _label(surface, text, u, edge + inward * height / surface.radius_at(u), height, along_edge=True)


def _block(surface: Frustum, u: float, phi: float, lines: tuple[str, ...], height: float) -> tuple[PartLabel, ...]:
    x, y = drawing_point(surface, u, phi)
    top = 0.5 * (len(lines) - 1)
    angle = -(phi - 0.5 * surface.wrap) * surface.sin_half_angle
    up = (-math.sin(angle), math.cos(angle))
    steps = [(top - i) * _LINE_PITCH * height for i in range(len(lines))]
    return tuple(
        PartLabel(line, x + step * up[0], y + step * up[1], height, angle)
        for line, step in zip(lines, steps, strict=True)
    )


def _label(surface: Frustum, text: str, u: float, phi: float, height: float, along_edge: bool = False) -> PartLabel:
    x, y = drawing_point(surface, u, phi)
    angle = -(phi - 0.5 * surface.wrap) * surface.sin_half_angle
    if along_edge:
        angle += 0.5 * math.pi
    angle = math.remainder(angle, math.pi)  # never upside down
    return PartLabel(text, x, y, height, angle)


def _inside(surface: Frustum, room: SurfaceRectangle, label: PartLabel) -> bool:
    """Return whether the corners of a label and the middles between them lie within a rectangle."""
    corners = list(label.corners())
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a in corners for b in corners if a < b]
    for x, y in corners + middles:
        u, phi = _locate(surface, x, y)
        if not (room.u1 <= u <= room.u2 and room.phi1 <= phi <= room.phi2):
            return False
    return True


def _locate(surface: Frustum, x: float, y: float) -> tuple[float, float]:
    """Return the slant distance [m] and azimuth [rad] of a point of the drawing [m]."""
    sa, rho1 = surface.sin_half_angle, surface.radius1
    along, across = rho1 + sa * y, sa * x
    rho = math.hypot(across, along)
    u = (sa * (x * x + y * y) + 2.0 * rho1 * y) / (rho1 + rho)
    angle = math.atan2(across, along)
    return u, (angle / sa if abs(angle) > 1e-9 else x / along) + 0.5 * surface.wrap


def _shrunk(surface: Frustum, room: SurfaceRectangle, width: float) -> SurfaceRectangle:
    """Return the rectangle without a border of a width [m]."""
    turn = width / surface.radius_at(0.5 * (room.u1 + room.u2))
    return SurfaceRectangle(room.u1 + width, room.u2 - width, room.phi1 + turn, room.phi2 - turn)
