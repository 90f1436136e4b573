"""What is written on the parts, where it fits and as large as it fits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from .electrodes import Layout, Patch
from .frustum import Frustum
from .pen import flat_point

__all__ = ["CAP_HEIGHT", "Label", "part_labels", "strip_label", "text_width"]

#: Height of a capital of Helvetica in em.
CAP_HEIGHT = 0.718
#: Widths of Helvetica from space to tilde [em / 1000], as published with the face (Adobe core 14).
_WIDTHS = (
    "278 278 355 556 556 889 667 191 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 278 278 "
    "584 584 584 556 1015 667 667 722 722 667 611 778 722 278 500 667 556 833 722 778 667 778 722 667 611 722 667 944 "
    "667 667 611 278 278 278 469 556 333 556 556 500 556 556 278 556 556 222 222 500 222 833 556 556 556 556 333 500 "
    "278 556 500 722 500 500 500 334 260 334 584"
)
_EM = tuple(int(width) / 1000.0 for width in _WIDTHS.split())
_LARGEST, _SMALLEST = 5e-3, 1.2e-3
_LINE = 1.7  # from one line to the next, in heights


@dataclass(frozen=True, slots=True)
class Label:
    """A line of text, centred on a point.

    Attributes:
        text: plain ASCII.
        x: of the centre [m].
        y: of the centre [m].
        height: of capitals [m].
        angle: of the line [rad], counter-clockwise.
    """

    text: str
    x: float
    y: float
    height: float
    angle: float = 0.0

    @property
    def width(self) -> float:
        """Length of the line in Helvetica [m]."""
        return text_width(self.text, self.height)

    def mirrored(self) -> Label:
        """At the place where the mirrored part needs it, still readable."""
        return replace(self, x=-self.x, angle=-self.angle)

    def corners(self) -> Iterator[tuple[float, float]]:
        """The four corners of its box [m]."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        for a in (-0.5 * self.width, 0.5 * self.width):
            for b in (-0.5 * self.height, 0.5 * self.height):
                yield self.x + a * c - b * s, self.y + a * s + b * c


def text_width(text: str, height: float) -> float:
    """Length of a line of ASCII in Helvetica, in the unit of the height of its capitals."""
    return sum(_EM[ord(letter) - 32] for letter in text) * height / CAP_HEIGHT


def part_labels(layout: Layout, surface: Frustum, lines: tuple[str, ...]) -> tuple[Label, ...]:
    """A block of lines in the middle of a sheet, and the names of its four sides.

    Args:
        layout: what lies where.
        surface: the cone for which the sheet is cut.
        lines: of the block, the most important first; the last ones are left out where all would be too small.
    """
    room = layout.active
    phi = 0.5 * (room.phi1 + room.phi2)
    height = _LARGEST
    while height >= _SMALLEST:
        sides = tuple(_sides(layout, surface, 0.6 * height))
        block = _block(surface, 0.5 * (room.u1 + room.u2), phi, lines, height)
        inner = _shrunk(surface, room, 2.0 * height)
        if all(_inside(surface, inner, label) for label in block) and all(
            _inside(surface, room, label) for label in sides
        ):
            return block + sides
        height *= 0.93
    return part_labels(layout, surface, lines[:-1]) if len(lines) > 1 else ()


def strip_label(layout: Layout, surface: Frustum, which: str, face: str) -> tuple[Label, ...]:
    """The name of an electrode and its face, along its strip, as long as the strip bends little enough."""
    plan, field = layout.plan, layout.field
    half = 0.5 * plan.electrode
    narrow = min(layout.sheet.radius1, layout.sheet.radius2)
    u, phi = {
        "A": (field.u2 + half, 0.5 * (field.phi1 + field.phi2)),
        "B": (field.u1 - half, 0.5 * (field.phi1 + field.phi2)),
        "C": (0.5 * (field.u1 + field.u2), field.phi2 + half / narrow),
        "D": (0.5 * (field.u1 + field.u2), field.phi1 - half / narrow),
    }[which]
    pad = 0.08 * plan.electrode
    turn = pad / narrow
    strip = {
        "A": Patch(field.u2 + pad, field.u2 + 2.0 * half - pad, 0.0, surface.wrap),
        "B": Patch(field.u1 - 2.0 * half + pad, field.u1 - pad, 0.0, surface.wrap),
        "C": Patch(0.0, surface.slant, field.phi2 + turn, field.phi2 + 2.0 * half / narrow - turn),
        "D": Patch(0.0, surface.slant, field.phi1 - 2.0 * half / narrow + turn, field.phi1 - turn),
    }[which]
    for text in (f"{which} - {face.upper()} FACE UP", which):
        height = min(3e-3, 0.6 * plan.electrode)
        while height >= _SMALLEST or text == which:
            label = _label(surface, text, u, phi, height, along_edge=which in "CD")
            if _inside(surface, strip, label):
                return (label,)
            height *= 0.9
            if height < 0.2e-3:
                break
    return ()


def _sides(layout: Layout, surface: Frustum, height: float) -> Iterator[Label]:
    room = layout.active
    u, phi = 0.5 * (room.u1 + room.u2), 0.5 * (room.phi1 + room.phi2)
    degrees = math.degrees(surface.wrap)
    yield _label(surface, "END 1 (B)", room.u1 + height, phi, height)
    yield _label(surface, "END 2 (A)", room.u2 - height, phi, height)
    for text, edge, inward in (("EDGE 0 (D)", room.phi1, 1.0), (f"EDGE {degrees:.4g} (C)", room.phi2, -1.0)):
        yield _label(surface, text, u, edge + inward * height / surface.radius_at(u), height, along_edge=True)


def _block(surface: Frustum, u: float, phi: float, lines: tuple[str, ...], height: float) -> tuple[Label, ...]:
    x, y = flat_point(surface, u, phi)
    top = 0.5 * (len(lines) - 1)
    angle = -(phi - 0.5 * surface.wrap) * surface.sin_half_angle
    up = (-math.sin(angle), math.cos(angle))
    steps = [(top - i) * _LINE * height for i in range(len(lines))]
    return tuple(
        Label(line, x + step * up[0], y + step * up[1], height, angle) for line, step in zip(lines, steps, strict=True)
    )


def _label(surface: Frustum, text: str, u: float, phi: float, height: float, along_edge: bool = False) -> Label:
    x, y = flat_point(surface, u, phi)
    angle = -(phi - 0.5 * surface.wrap) * surface.sin_half_angle
    if along_edge:
        angle += 0.5 * math.pi
    angle = math.remainder(angle, math.pi)  # never upside down
    return Label(text, x, y, height, angle)


def _inside(surface: Frustum, room: Patch, label: Label) -> bool:
    """Whether the corners of a label lie within a patch, and an arc does not run through it."""
    corners = list(label.corners())
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a in corners for b in corners if a < b]
    for x, y in corners + middles:
        u, phi = _locate(surface, x, y)
        if not (room.u1 <= u <= room.u2 and room.phi1 <= phi <= room.phi2):
            return False
    return True


def _locate(surface: Frustum, x: float, y: float) -> tuple[float, float]:
    """Slant distance and azimuth of a point of the drawing."""
    sa, rho1 = surface.sin_half_angle, surface.radius1
    along, across = rho1 + sa * y, sa * x
    rho = math.hypot(across, along)
    u = (sa * (x * x + y * y) + 2.0 * rho1 * y) / (rho1 + rho)
    angle = math.atan2(across, along)
    return u, (angle / sa if abs(angle) > 1e-9 else x / along) + 0.5 * surface.wrap


def _shrunk(surface: Frustum, room: Patch, width: float) -> Patch:
    """The patch without a border of a width."""
    turn = width / surface.radius_at(0.5 * (room.u1 + room.u2))
    return Patch(room.u1 + width, room.u2 - width, room.phi1 + turn, room.phi2 - turn)
