"""Nesting of all parts of one material on the bed of a cutter. The only importer of rpack (rectangle-packer).

Parts are packed by their boxes, each turned so that its box is the smallest. What a sector leaves free beside itself is
waste; a solver for free shapes would save part of it, but finds another answer on every run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coneskin.core.errors import GeometryError, needed_package

from .cut_sheet import CutPart, CutSheet, Stroke

_GRID_STEP = 1e-3  # m; boxes are packed in whole millimetres
_MIN_BED_SIDE, _MAX_BED_SIDE = 0.05, 10.0  # m; side of a bed


@dataclass(frozen=True, slots=True)
class MaterialBed:
    """One piece of material with the parts that are cut from it."""

    material: str  #: its name
    number: int  #: of the piece among those of its material, from 1
    sheets: tuple[CutSheet, ...]  #: the parts at their places; the lower left corner of the bed is (0, 0)
    used: tuple[float, float]  #: width and depth of the corner of the bed that holds all parts [m]

    @property
    def slug(self) -> str:
        """Name for files."""
        words = "".join(letter if letter.isascii() and letter.isalnum() else " " for letter in self.material).split()
        return "-".join([*(words or ["material"]), str(self.number)]).lower()

    @property
    def waste(self) -> float:
        """Share of the used corner that is in no part."""
        area = math.fsum(part.area for sheet in self.sheets for part in sheet.parts)
        return 1.0 - area / (self.used[0] * self.used[1])


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part, turned so that its box is the smallest and lies at (0, 0)."""

    sheet: CutSheet
    part: CutPart
    size: tuple[int, int]


def require_nesting() -> None:
    """Refuse to go on without the package that nests parts.

    Raises:
        MissingExtra: rectangle-packer is not installed.
    """
    with needed_package("rectangle-packer", "nesting parts on a bed", "design"):
        import rpack  # noqa: F401


def nest_on_beds(
    sheets: Sequence[CutSheet], width: float, depth: float, gap: float = 3e-3
) -> tuple[tuple[MaterialBed, ...], tuple[str, ...]]:
    """Nest the parts of each material on as few beds as the packing finds.

    Args:
        sheets: cut sheets, with the kerf in their outlines.
        width: of the bed [m].
        depth: of the bed [m].
        gap: between parts, and between parts and the border of the bed [m].

    Returns:
        the beds; and a sentence for each part that is larger than the bed.

    Raises:
        GeometryError: the bed or the gap is out of range.
        MissingExtra: rectangle-packer is not installed.
    """
    require_nesting()
    import rpack

    if not (_MIN_BED_SIDE <= width <= _MAX_BED_SIDE and _MIN_BED_SIDE <= depth <= _MAX_BED_SIDE and 0.0 <= gap <= 0.1):
        raise GeometryError(
            f"a bed is from {_MIN_BED_SIDE * 1e3:g} to {_MAX_BED_SIDE * 1e3:g} mm wide and deep, with gaps from 0 to "
            f"100 mm, got {width * 1e3:.4g} x {depth * 1e3:.4g} mm with {gap * 1e3:.4g} mm"
        )
    room = math.floor((width - gap) / _GRID_STEP + 1e-6), math.floor((depth - gap) / _GRID_STEP + 1e-6)

    def packed(sizes: list[tuple[int, int]]) -> list[tuple[int, int]] | None:
        if any(w > room[0] or d > room[1] for w, d in sizes):
            return None
        try:
            return list(rpack.pack(sizes, max_width=room[0], max_height=room[1]))
        except rpack.PackingImpossibleError:
            return None

    beds: list[MaterialBed] = []
    larger: list[str] = []
    for material in dict.fromkeys(sheet.material for sheet in sheets):
        pieces = [_smallest(sheet, part, gap) for sheet in sheets if sheet.material == material for part in sheet.parts]
        pieces.sort(key=lambda piece: -piece.size[0] * piece.size[1])
        filled: list[list[_Piece]] = []
        for piece in pieces:
            ways = (piece, _quarter_turned(piece, gap))
            for on_bed in [*filled, []]:
                way = next((way for way in ways if packed([item.size for item in [*on_bed, way]]) is not None), None)
                if way is not None:
                    if not on_bed:
                        filled.append(on_bed)
                    on_bed.append(way)
                    break
            else:
                w, d = (size * _GRID_STEP * 1e3 for size in piece.size)
                larger.append(
                    f"{piece.sheet.slug}, {piece.part.name}: {w:.0f} x {d:.0f} mm does not fit on a bed of "
                    f"{width * 1e3:g} x {depth * 1e3:g} mm: name a larger one, or cut it from its own file"
                )
        for number, on_bed in enumerate(filled, 1):
            places = packed([piece.size for piece in on_bed])
            assert places is not None
            merged: dict[str, CutSheet] = {}
            for piece, (x, y) in zip(on_bed, places, strict=True):
                moved = replace(piece.sheet, parts=(piece.part,)).moved(x * _GRID_STEP + gap, y * _GRID_STEP + gap)
                known = merged.get(moved.slug)
                merged[moved.slug] = moved if known is None else replace(known, parts=known.parts + moved.parts)
            right, top = (
                max(at[i] + piece.size[i] for piece, at in zip(on_bed, places, strict=True)) * _GRID_STEP + gap
                for i in (0, 1)
            )
            beds.append(MaterialBed(material, number, tuple(merged.values()), (right, top)))
    return tuple(beds), tuple(larger)


def _smallest(sheet: CutSheet, part: CutPart, gap: float) -> _Piece:
    """Turn a part so that one of its straight borders lies along the bed and its box is the smallest."""
    angles = {
        round(math.remainder(segment.heading(0.0), 0.5 * math.pi), 9)
        for stroke in part.strokes
        if stroke.kind == "cut"
        for segment in stroke.outline.segments()
        if segment.bulge == 0.0
    }
    ways = [_piece(sheet, _rotated(part, -angle), gap) for angle in sorted({0.0, *angles})]
    best = min(ways, key=lambda piece: piece.size[0] * piece.size[1])
    return best if best.size[0] >= best.size[1] else _quarter_turned(best, gap)


def _quarter_turned(piece: _Piece, gap: float) -> _Piece:
    return _piece(piece.sheet, _rotated(piece.part, 0.5 * math.pi), gap)


def _piece(sheet: CutSheet, part: CutPart, gap: float) -> _Piece:
    """Return a part with its box at (0, 0); the size of the box includes the gap on its right and above it."""
    x0, y0, x1, y1 = replace(sheet, parts=(part,)).bounds
    (moved,) = replace(sheet, parts=(part,)).moved(-x0, -y0).parts
    return _Piece(
        sheet, moved, (math.ceil((x1 - x0 + gap) / _GRID_STEP - 1e-6), math.ceil((y1 - y0 + gap) / _GRID_STEP - 1e-6))
    )


def _rotated(part: CutPart, angle: float) -> CutPart:
    c, s = math.cos(angle), math.sin(angle)
    return replace(
        part,
        strokes=tuple(Stroke(stroke.kind, stroke.outline.rotated(angle)) for stroke in part.strokes),
        labels=tuple(
            replace(label, x=c * label.x - s * label.y, y=s * label.x + c * label.y, angle=label.angle + angle)
            for label in part.labels
        ),
    )
