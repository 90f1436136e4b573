"""Cut sheets of a sensor: the outlines, holes, marks and labels of each material.

There are seven: lower substrate, lower electrodes, lower conductive, isolation, upper conductive, upper electrodes,
upper substrate. A part that is laid with the other face up is its mirror image, with tabs and leads on the wrong side,
so every part is labelled with the face that is up. By default that is the face on which the next part is glued, and of
a cover that is wrapped last its outside, on which its labels can be read.
Electrodes go on the face of each conductive sheet that faces the isolation: a printed or coated film conducts on that
face alone.
"""

from __future__ import annotations

import math
import unicodedata
from dataclasses import dataclass, replace
from typing import Literal

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

from .electrode_layout import SheetLayout, SurfaceRectangle, _edge_room
from .layer_stack import LayerStack, snap_to_cylinder
from .outline import Outline, circle_outline, joint_bounds
from .part_labels import PartLabel, part_labels, strip_label
from .surface_shape import ShapeCorner, ShapeTab, SurfaceShape, draw_shape, drawing_point
from .touch_marks import CoverMarks, marks_on_link


def _layout_above(layout: SheetLayout, place: PlacedFrustum, height: float) -> SheetLayout:
    """Return a layout for a layer at a height [m] above the link, so that its features lie on the same normals.

    The layers of a cone grow evenly and share their azimuths. Around a link of another section a layer grows at the
    bends only, and each feature moves in the flat pattern by what the bends before it have grown.
    """
    if not place.bends:
        return layout

    def above(phi: float) -> float:
        return place.azimuth_above(height, phi)

    def shape(outline: SurfaceShape) -> SurfaceShape:
        return tuple(replace(element, phi=above(element.phi)) for element in outline)

    def box(area: SurfaceRectangle) -> SurfaceRectangle:
        return replace(area, phi1=above(area.phi1), phi2=above(area.phi2))

    return replace(
        layout,
        field=box(layout.field),
        active=box(layout.active),
        rim=shape(layout.rim),
        upper=shape(layout.upper),
        lower=shape(layout.lower),
        foils={name: shape(outline) for name, outline in layout.foils.items()},
        marks={name: tuple(shape(outline) for outline in outlines) for name, outlines in layout.marks.items()},
        folds={name: shape(outline) for name, outline in layout.folds.items()},
        holes=tuple((u, above(phi)) for u, phi in layout.holes),
    )


_StrokeKind = Literal["cut", "hole", "score", "fold"]
_SheetFace = Literal["outside", "inside"]
FaceUp = Literal["work", "outside", "inside"]
#: colour of each kind of line (red, green, blue), none of them white; a cutter selects speed and power by it
LINE_COLOURS: dict[str, tuple[int, int, int]] = {
    "cut": (255, 0, 0),
    "hole": (255, 0, 255),
    "score": (0, 0, 255),
    "fold": (0, 153, 0),
    "label": (0, 0, 0),
}
_LONGEST_TITLE = 40  # letters; a longer line would make all text on a part small
_WIDEST_FLAP = 0.25  # of the way around the narrow end; a wider flap covers the active area twice


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line for the cutter."""

    kind: _StrokeKind  #: cut (an outer border), hole, score (a mark, not a cut) or fold
    outline: Outline  #: its course on the flat pattern


@dataclass(frozen=True, slots=True)
class CutPart:
    """One piece of material."""

    name: str
    strokes: tuple[Stroke, ...]  #: lines for the cutter, in order: marks, holes, then the border
    labels: tuple[PartLabel, ...]

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
    """The parts that are cut from one material."""

    number: int  #: position in the order of assembly, from the link outwards, from 1
    name: str  #: of the layer
    material: str  #: material and thickness
    face: _SheetFace  #: face of the sensor that is up in the drawing
    surface: Frustum  #: cone for which the parts are cut
    parts: tuple[CutPart, ...]

    @property
    def slug(self) -> str:
        """Name for files and layers."""
        return f"{self.number}-{self.name.replace(' ', '-')}"

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y of all strokes [m]."""
        return joint_bounds(stroke.outline.bounds for part in self.parts for stroke in part.strokes)

    def moved(self, dx: float, dy: float) -> CutSheet:
        """Return the cut sheet, shifted by dx and dy [m]."""
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
    layout: SheetLayout,
    stack: LayerStack,
    place: PlacedFrustum | None = None,
    *,
    title: str = "sheet",
    kerf: float = 0.0,
    overlap: float = 0.0,
    snap: float = 1e-5,
    face_up: FaceUp = "work",
    joints: tuple[str, ...] = ("", ""),
) -> tuple[CutSheet, ...]:
    """Draw the seven cut sheets of a sensor.

    Args:
        place: of the sheet, whose side is that of the layout; None for a cone anywhere.
        title: written on every part.
        kerf: width of the cut [m]; borders grow and holes shrink by half of it.
        overlap: width of a flap that closes the seam, on the upper substrate beyond phi = wrap [m].
        snap: a layer is cut as a rectangle where that moves no cut by more than this [m].
        face_up: "work" for the face on which the next part is glued, or one face for all parts.
        joints: what is written beside the names of end 1 and end 2.

    Raises:
        GeometryError: kerf, overlap or snap is negative or not finite, a detail is smaller than the kerf, or
            the overlap runs into tabs or the other edge.
    """
    for name, value in (("kerf", kerf), ("overlap", overlap), ("snap", snap)):
        if not (math.isfinite(value) and value >= 0.0):
            raise GeometryError(f"{name} must be finite and not negative, got {value * 1e3:.4g} mm")
    if overlap and layout.plan.wires.startswith("edge"):
        raise GeometryError(f"an overlap would cover the tabs at {layout.plan.wires}: let the wires leave at an end")
    around = layout.sheet.wrap * min(layout.sheet.radius1, layout.sheet.radius2)
    if overlap > _WIDEST_FLAP * around:
        raise GeometryError(
            f"an overlap must be at most {_WIDEST_FLAP:.0%} of the narrow end, {_WIDEST_FLAP * around * 1e3:.4g} mm, "
            f"got {overlap * 1e3:.4g} mm"
        )
    if overlap and overlap >= _edge_room(layout.sheet):
        raise GeometryError(
            f"an overlap of {overlap * 1e3:.4g} mm runs into the other edge of the flat pattern, "
            f"{_edge_room(layout.sheet) * 1e3:.4g} mm away: make it narrower"
        )
    plain = _ascii_text(title)[:_LONGEST_TITLE]
    place = place or PlacedFrustum(layout.sheet)
    flat = layout

    def sheet(number: int, name: str, index: int, face: _SheetFace, foil: bool = False) -> CutSheet:
        face = face if face_up == "work" else face_up
        surface = snap_to_cylinder(stack.surface(place, index), snap)
        layout = _layout_above(flat, place, stack.offset(index))
        layer = stack.layers[index]
        text = (plain, f"{number} {name.upper()}", f"{face.upper()} FACE UP")
        material = "aluminium foil" if foil else f"{layer.material} {layer.thickness * 1e3:.2f} mm"
        if foil:
            pair = "CD" if index < 2 else "AB"
            parts = tuple(_foil(layout, surface, which, face, plain) for which in pair)
        else:
            crosses = None
            if index == 4:
                above = [(u, place.azimuth_above(stack.offset(4), phi)) for u, phi in marks_on_link(flat, stack, place)]
                crosses = CoverMarks(layout, surface, above)
            strokes = _marks(layout, surface, index, crosses, stack.assembly != "loose") + _border(
                layout, surface, index, overlap if index == 4 else 0.0
            )
            ends = tuple(
                f"{end} {joint}".strip() for end, joint in zip(("END 1 (B)", "END 2 (A)"), joints, strict=True)
            )
            clear = crosses.clear if crosses else None
            labels = part_labels(layout, surface, (*text, _ascii_text(material)), clear, ends)
            labels += tuple(crosses.labels()) if crosses else ()
            parts = (CutPart(name, strokes, labels),)
        return CutSheet(
            number, name, material, face, surface, tuple(_finish(part, kerf, face == "inside") for part in parts)
        )

    return (
        sheet(1, "lower substrate", 0, "outside"),
        sheet(2, "lower electrodes", 1, "outside", foil=True),
        sheet(3, "lower conductive", 1, "outside"),
        sheet(4, "isolation", 2, "outside"),
        sheet(5, "upper conductive", 3, "inside"),
        sheet(6, "upper electrodes", 3, "inside", foil=True),
        sheet(7, "upper substrate", 4, "outside" if stack.assembly == "loose" else "inside"),
    )


def _ascii_text(text: str) -> str:
    """Return a text in ASCII, which every cutter has letters for: accents are dropped, other letters become ?."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    letters = (letter for letter in plain if not unicodedata.combining(letter))
    return "".join(letter if " " <= letter <= "~" else "?" for letter in letters)


def nest_sheets(sheets: tuple[CutSheet, ...], gap: float = 10e-3) -> tuple[CutSheet, ...]:
    """Arrange sheets side by side in rows, a gap [m] apart, with the lower left corner of all at (0, 0)."""
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


def _border(layout: SheetLayout, surface: Frustum, index: int, overlap: float) -> tuple[Stroke, ...]:
    shape = {1: layout.lower, 3: layout.upper}.get(index, layout.rim)
    radius = 0.5 * layout.plan.hole
    strokes = [Stroke("hole", circle_outline(*drawing_point(surface, *hole), radius)) for hole in layout.holes]
    if overlap:
        slant, wrap = surface.slant, surface.wrap
        flap = ShapeTab(0.5 * slant, wrap, slant, overlap, "edge1")
        seam = (ShapeCorner(0.0, wrap), ShapeCorner(slant, wrap))
        shape = (ShapeCorner(0.0, 0.0), seam[0], flap, seam[1], ShapeCorner(slant, 0.0))
        strokes.insert(0, Stroke("fold", draw_shape(surface, seam, closed=False)))
    return (*strokes, Stroke("cut", draw_shape(surface, shape)))


def _marks(
    layout: SheetLayout, surface: Frustum, index: int, crosses: CoverMarks | None, glued: bool
) -> tuple[Stroke, ...]:
    """Mark the conductive sheet on its substrate, the electrodes on their conductive sheet, touches on the cover."""
    if index == 0:
        return (Stroke("score", draw_shape(surface, layout.lower)),)
    if crosses:
        lines = (Stroke("score", draw_shape(surface, line, closed=False)) for line in crosses.lines())
        outline = (Stroke("score", draw_shape(surface, layout.upper)),)  # on the face that the sheet is glued to
        return (*(outline if glued else ()), *lines)
    marks: tuple[SurfaceShape, ...] = layout.marks.get({1: "lower", 3: "upper"}.get(index, ""), ())
    return tuple(Stroke("score", draw_shape(surface, mark, closed=False)) for mark in marks)


def _foil(layout: SheetLayout, surface: Frustum, which: str, face: _SheetFace, title: str) -> CutPart:
    strokes = [Stroke("cut", draw_shape(surface, layout.foils[which]))]
    if which in layout.folds:
        strokes.insert(0, Stroke("fold", draw_shape(surface, layout.folds[which], closed=False)))
    return CutPart(f"electrode {which}", tuple(strokes), strip_label(layout, surface, which, face, title))


def _finish(part: CutPart, kerf: float, mirror: bool) -> CutPart:
    """Return the part with its cuts moved out by half the kerf, mirrored where its inside is up."""
    grow = {"cut": 0.5 * kerf, "hole": -0.5 * kerf}
    strokes = []
    for stroke in part.strokes:
        outline = stroke.outline.offset(grow[stroke.kind]) if stroke.kind in grow else stroke.outline
        strokes.append(Stroke(stroke.kind, outline.mirrored() if mirror else outline))
    labels = tuple(label.mirrored() for label in part.labels) if mirror else part.labels
    return CutPart(part.name, tuple(strokes), labels)


TEST_SQUARE = 40e-3  #: side of the square [m], drawn without a kerf
TEST_HOLE = 20e-3  #: side of its hole [m]
_TICK_LENGTH = 2e-3  # m; from the border to the marked square
_LETTER_HEIGHT = 3e-3  # m


def make_test_piece(material: str) -> CutSheet:
    """Draw the test piece of a material; its lines have no kerf, so that the kerf can be measured on it."""
    half, inner = 0.5 * TEST_SQUARE, 0.5 * TEST_HOLE
    strokes = (_square("score", half - _TICK_LENGTH), _square("hole", inner), _square("cut", half))
    side, hole = f"{TEST_SQUARE * 1e3:g} mm", f"hole {TEST_HOLE * 1e3:g} mm"
    middle = 0.5 * (half - _TICK_LENGTH + inner)
    labels = (PartLabel(f"TEST {side}", 0.0, middle, _LETTER_HEIGHT), PartLabel(hole, 0.0, -middle, _LETTER_HEIGHT))
    flat = Frustum(half, half, TEST_SQUARE)
    return CutSheet(0, "test piece", material, "outside", flat, (CutPart("test piece", strokes, labels),))


def _square(kind: _StrokeKind, half: float) -> Stroke:
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return Stroke(kind, Outline(tuple((x, y, 0.0) for x, y in corners)))
