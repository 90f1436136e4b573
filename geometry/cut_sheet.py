"""What is cut from each material: outlines, holes, marks and labels.

Seven cut sheets, in the order of assembly: lower substrate, lower electrodes, lower conductive, isolation, upper
conductive, upper electrodes, upper substrate. A drawing seen from the other face is its mirror image, which puts tabs
and leads on the wrong side; so every part says which face is up. By default that is the face on which the next thing
is glued: electrodes go on the back of each conductive sheet, between it and its substrate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from coneskin.errors import GeometryError

from .electrodes import Layout, edge_room
from .frustum import Frustum
from .outline import Outline
from .part_labels import Label, part_labels, strip_label
from .pen import Corner, Shape, Tab, draw, draw_circle
from .stack import Stack, snap_to_cylinder

__all__ = ["PALETTE", "CutSheet", "Face", "FaceUp", "Kind", "Part", "Stroke", "cut_sheets", "nest"]

Kind = Literal["cut", "hole", "score", "fold"]
Face = Literal["outside", "inside"]
FaceUp = Literal["work", "outside", "inside"]
#: Colour of each kind of line (red, green, blue), none of them white; cutters choose speed and power by it.
PALETTE: dict[str, tuple[int, int, int]] = {
    "cut": (255, 0, 0),
    "hole": (255, 0, 255),
    "score": (0, 0, 255),
    "fold": (0, 153, 0),
    "label": (0, 0, 0),
}


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line for the cutter: cut (an outer border), hole, score (a mark, not a cut) or fold."""

    kind: Kind
    outline: Outline


@dataclass(frozen=True, slots=True)
class Part:
    """One piece of material.

    Attributes:
        name: what it is.
        strokes: what the cutter does, in this order: marks, holes, then the border.
        labels: what is written on it.
    """

    name: str
    strokes: tuple[Stroke, ...]
    labels: tuple[Label, ...]

    @property
    def area(self) -> float:
        """Area of the material that remains [m2]."""
        sign = {"cut": 1.0, "hole": -1.0}
        return math.fsum(sign.get(s.kind, 0.0) * abs(s.outline.area) for s in self.strokes if s.outline.closed)

    @property
    def cut_length(self) -> float:
        """Length of all cuts [m]."""
        return math.fsum(s.outline.length for s in self.strokes if s.kind in ("cut", "hole"))


@dataclass(frozen=True, slots=True)
class CutSheet:
    """The parts that are cut from one material.

    Attributes:
        number: place in the order of assembly, from the link outwards, from 1.
        name: of the layer.
        material: what it is cut from, with its thickness.
        face: the face of the sensor that is up in the drawing.
        surface: the cone for which it is cut.
        parts: the pieces.
    """

    number: int
    name: str
    material: str
    face: Face
    surface: Frustum
    parts: tuple[Part, ...]

    @property
    def slug(self) -> str:
        """Name for files and layers."""
        return f"{self.number}-{self.name.replace(' ', '-')}"

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y of all strokes [m]."""
        boxes = [stroke.outline.bounds for part in self.parts for stroke in part.strokes]
        lows, highs = [box[:2] for box in boxes], [box[2:] for box in boxes]
        return min(x for x, _ in lows), min(y for _, y in lows), max(x for x, _ in highs), max(y for _, y in highs)

    def moved(self, dx: float, dy: float) -> CutSheet:
        """The sheet, shifted [m]."""
        parts = (
            replace(
                part,
                strokes=tuple(Stroke(s.kind, s.outline.moved(dx, dy)) for s in part.strokes),
                labels=tuple(replace(label, x=label.x + dx, y=label.y + dy) for label in part.labels),
            )
            for part in self.parts
        )
        return replace(self, parts=tuple(parts))


def cut_sheets(
    layout: Layout,
    stack: Stack,
    *,
    title: str = "sheet",
    kerf: float = 0.0,
    overlap: float = 0.0,
    snap: float = 1e-5,
    face_up: FaceUp = "work",
) -> tuple[CutSheet, ...]:
    """Draw everything that is cut for one sheet.

    Args:
        layout: what lies where.
        stack: the layers.
        title: written on every part.
        kerf: width that the cutter takes away [m]; borders grow and holes shrink by half of it.
        overlap: width of a flap that closes the seam, on the upper substrate beyond phi = wrap [m].
        snap: a layer is cut as a rectangle where that moves no cut by more than this [m].
        face_up: "work" for the face on which the next thing is glued, or the same face for all.

    Raises:
        GeometryError: kerf, overlap or snap is negative or not finite, or the kerf swallows a detail.
    """
    for name, value in (("kerf", kerf), ("overlap", overlap), ("snap", snap)):
        if not (math.isfinite(value) and value >= 0.0):
            raise GeometryError(f"{name} must be finite and not negative, got {value * 1e3:.4g} mm")
    if overlap and layout.plan.wires == "edge1":
        raise GeometryError("an overlap at edge1 would cover the tabs there: let the wires leave on another side")
    if overlap and overlap >= edge_room(layout.sheet):
        raise GeometryError(
            f"an overlap of {overlap * 1e3:.4g} mm runs into the other edge of the flat pattern, "
            f"{edge_room(layout.sheet) * 1e3:.4g} mm away"
        )

    def sheet(number: int, name: str, index: int, face: Face, foil: bool = False) -> CutSheet:
        face = face if face_up == "work" else face_up
        surface = snap_to_cylinder(stack.surface(layout.sheet, index), snap)
        layer = stack.layers[index]
        text = (title, name.upper(), f"{face.upper()} FACE UP")
        material = "aluminium foil" if foil else f"{layer.material} {layer.thickness * 1e3:.2f} mm"
        if foil:
            pair = "CD" if index < 2 else "AB"
            parts = tuple(_foil(layout, surface, which, face) for which in pair)
        else:
            strokes = _marks(layout, surface, index) + _border(layout, surface, index, overlap if index == 4 else 0.0)
            parts = (Part(name, strokes, part_labels(layout, surface, (*text, material))),)
        return CutSheet(
            number, name, material, face, surface, tuple(_finish(part, kerf, face == "inside") for part in parts)
        )

    return (
        sheet(1, "lower substrate", 0, "outside"),
        sheet(2, "lower electrodes", 1, "inside", foil=True),
        sheet(3, "lower conductive", 1, "inside"),
        sheet(4, "isolation", 2, "outside"),
        sheet(5, "upper conductive", 3, "outside"),
        sheet(6, "upper electrodes", 3, "outside", foil=True),
        sheet(7, "upper substrate", 4, "inside"),
    )


def nest(sheets: tuple[CutSheet, ...], gap: float = 10e-3) -> tuple[CutSheet, ...]:
    """Lay sheets out side by side in rows, a gap [m] apart, with the lower left corner of all at 0, 0."""
    boxes = [sheet.bounds for sheet in sheets]
    widths = [x1 - x0 for x0, _, x1, _ in boxes]
    room = max(max(widths), math.sqrt(1.2 * sum(w * (b[3] - b[1]) for w, b in zip(widths, boxes, strict=True))))
    placed, x, y, row_top = [], 0.0, 0.0, 0.0
    for sheet, (x0, y0, x1, y1) in zip(sheets, boxes, strict=True):
        if x > 0.0 and x + x1 - x0 > room:
            x, y = 0.0, row_top + gap
        placed.append(sheet.moved(x - x0, y - y0))
        x, row_top = x + x1 - x0 + gap, max(row_top, y + y1 - y0)
    return tuple(placed)


def _border(layout: Layout, surface: Frustum, index: int, overlap: float) -> tuple[Stroke, ...]:
    shape = {1: layout.lower, 3: layout.upper}.get(index, layout.rim)
    strokes = [Stroke("hole", draw_circle(surface, u, phi, layout.plan.hole)) for u, phi in layout.holes]
    if overlap:
        slant, wrap = surface.slant, surface.wrap
        flap = Tab(0.5 * slant, wrap, slant, overlap, "edge1")
        seam = (Corner(0.0, wrap), Corner(slant, wrap))
        shape = (Corner(0.0, 0.0), seam[0], flap, seam[1], Corner(slant, 0.0))
        strokes.insert(0, Stroke("fold", draw(surface, seam, closed=False)))
    return (*strokes, Stroke("cut", draw(surface, shape)))


def _marks(layout: Layout, surface: Frustum, index: int) -> tuple[Stroke, ...]:
    """On a substrate the place of its conductive sheet, on a conductive sheet the places of its electrodes."""
    if index in (0, 4):
        return (Stroke("score", draw(surface, layout.lower if index == 0 else layout.upper)),)
    marks: tuple[Shape, ...] = layout.marks.get({1: "lower", 3: "upper"}.get(index, ""), ())
    return tuple(Stroke("score", draw(surface, mark, closed=False)) for mark in marks)


def _foil(layout: Layout, surface: Frustum, which: str, face: Face) -> Part:
    strokes = [Stroke("cut", draw(surface, layout.foils[which]))]
    if which in layout.folds:
        strokes.insert(0, Stroke("fold", draw(surface, layout.folds[which], closed=False)))
    return Part(f"electrode {which}", tuple(strokes), strip_label(layout, surface, which, face))


def _finish(part: Part, kerf: float, mirror: bool) -> Part:
    """The part with its cuts moved out by half the kerf, mirrored where its inside is up."""
    grow = {"cut": 0.5 * kerf, "hole": -0.5 * kerf}
    strokes = []
    for stroke in part.strokes:
        outline = stroke.outline.offset(grow[stroke.kind]) if stroke.kind in grow else stroke.outline
        strokes.append(Stroke(stroke.kind, outline.mirrored() if mirror else outline))
    labels = tuple(label.mirrored() for label in part.labels) if mirror else part.labels
    return Part(part.name, tuple(strokes), labels)
