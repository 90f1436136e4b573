"""Cut sheets as PDF at 1:1, tiled over pages of a printer.

The drawing is one form, in millimetres, that every page shows through its own window. Windows meet without overlap at
the crop marks; a bleed of a few millimetres is printed beyond them, so that an inaccurate cut leaves no white border.
Layers are optional content, and the file asks viewers not to scale when they print.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import GeometryError

from .cut_sheet import LINE_COLOURS, CutSheet
from .outline import Outline, circle_outline, joint_bounds
from .part_labels import CAP_HEIGHT, PartLabel


def _pdf_number(value: float) -> str:
    """Return a number to five decimals without an exponent, which PDF does not allow."""
    text = f"{value:.5f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


class _PdfWriter:
    """Collection of the objects of a file, written at the end (PDF 1.5, ISO 32000-1 section 7.5)."""

    def __init__(self) -> None:
        self._objects: list[str] = ["", ""]  # 1: catalogue, 2: page tree
        self._pages: list[int] = []

    def add(self, body: str) -> int:
        """Add an object and return its number."""
        self._objects.append(body)
        return len(self._objects)

    def add_stream(self, data: str, entries: str = "") -> int:
        """Add a stream of ASCII text with further entries for its dictionary and return its number."""
        return self.add(f"<< {entries} /Length {len(data)} >>\nstream\n{data}\nendstream")

    def add_page(self, entries: str) -> None:
        """Add a page with the entries of its dictionary."""
        self._pages.append(self.add(f"<< /Type /Page /Parent 2 0 R {entries} >>"))

    def finish(self, entries: str, title: str) -> bytes:
        """Return the bytes of the file, with further entries for the catalogue and a title."""
        info = self.add(f"<< /Title ({_escaped(title)}) /Producer (coneskin) >>")
        kids = " ".join(f"{page} 0 R" for page in self._pages)
        self._objects[0] = f"<< /Type /Catalog /Pages 2 0 R {entries} >>"
        self._objects[1] = f"<< /Type /Pages /Kids [{kids}] /Count {len(self._pages)} >>"
        # four bytes above 127 tell transfer programs that the file is binary
        data, starts = bytearray(b"%PDF-1.5\n%\xe2\xe3\xcf\xd3\n"), []
        for index, body in enumerate(self._objects, start=1):
            starts.append(len(data))
            data += f"{index} 0 obj\n{body}\nendobj\n".encode("ascii", "replace")
        table = len(data)
        data += f"xref\n0 {len(starts) + 1}\n0000000000 65535 f \n".encode()
        data += b"".join(b"%010d 00000 n \n" % start for start in starts)
        data += f"trailer\n<< /Size {len(starts) + 1} /Root 1 0 R /Info {info} 0 R >>\n".encode()
        return bytes(data + f"startxref\n{table}\n%%EOF\n".encode())


_SIDE_MARGIN = 14.0  # mm; left and right margin of a page, for crop marks
_TOP_MARGIN = 14.0  # mm; top margin of a page, for crop marks
_BOTTOM_MARGIN = 24.0  # mm; bottom margin of a page, for crop marks and the scale bar
_MARK_SIZE = 5.0  # mm; a longer line is no mark to touch
_MARK_ROOM = 8.0  # mm; of a mark and its number from where pages join, so that no crosses meet
_SAMPLE_STEP = 0.5e-3  # m; distance of points along strokes by which used pages are found


@dataclass(frozen=True, slots=True)
class _PageTiling:
    """Pages of a drawing, each with a window on it; all lengths in mm.

    Attributes:
        width: of a page.
        height: of a page.
        counts: columns and rows of windows.
        origin: lower left corner of the first window in the drawing.
        extent: smallest x, smallest y, largest x and largest y of the drawing.
        cells: (column, row) of the windows that are not empty, in reading order from the top left.
    """

    width: float
    height: float
    counts: tuple[int, int]
    origin: tuple[float, float]
    extent: tuple[float, float, float, float]
    cells: tuple[tuple[int, int], ...]

    @property
    def window(self) -> tuple[float, float]:
        """Width and height of a window."""
        return self.width - 2.0 * _SIDE_MARGIN, self.height - _TOP_MARGIN - _BOTTOM_MARGIN


def _tile_pages(sheets: Sequence[CutSheet], width: float, height: float) -> _PageTiling:
    """Spread sheets over pages of a size [mm], in portrait or landscape, whichever needs fewer pages."""
    x0, y0, x1, y1 = joint_bounds(sheet.bounds for sheet in sheets)
    extent = (x0 * 1e3, y0 * 1e3, x1 * 1e3, y1 * 1e3)
    strokes = [stroke for sheet in sheets for part in sheet.parts for stroke in part.strokes]
    boxes = 1e3 * np.array([stroke.outline.bounds for stroke in strokes if stroke.kind == "score"]).reshape(-1, 2, 2)
    marks = boxes[(boxes[:, 1] - boxes[:, 0]).max(axis=1) < _MARK_SIZE].mean(axis=1)
    segments = (segment for stroke in strokes for segment in stroke.outline.segments())
    points = 1e3 * np.concatenate([one.along(math.ceil(one.length / _SAMPLE_STEP)) for one in segments])
    options = [_spread(points, marks, extent, *size) for size in ((width, height), (height, width))]
    return min(options, key=lambda option: len(option.cells))


def _spread(
    points: Floats, marks: Floats, extent: tuple[float, float, float, float], width: float, height: float
) -> _PageTiling:
    x0, y0, x1, y1 = extent
    window_x, window_y = width - 2.0 * _SIDE_MARGIN, height - _TOP_MARGIN - _BOTTOM_MARGIN
    columns, rows = max(1, math.ceil((x1 - x0) / window_x)), max(1, math.ceil((y1 - y0) / window_y))
    left = _clear_start(marks[:, 0], (x0, x1), columns, window_x)
    bottom = _clear_start(marks[:, 1], (y0, y1), rows, window_y)
    places = (points - (left, bottom)) / (window_x, window_y)
    column, row = np.minimum(places.astype(int), (columns - 1, rows - 1)).T
    seen = {divmod(int(cell), rows) for cell in np.unique(column * rows + row)}
    cells = tuple(sorted(seen, key=lambda cell: (-cell[1], cell[0])))
    return _PageTiling(width, height, (columns, rows), (left, bottom), extent, cells)


def _clear_start(marks: Floats, extent: tuple[float, float], count: int, step: float) -> float:
    """Return where the first of some windows begins [mm]: centred, or beside, where no join meets marks [mm]."""
    slack = count * step - (extent[1] - extent[0])
    start = extent[0] - 0.5 * slack
    shifts = sorted(slack * np.linspace(-0.5, 0.5, 41), key=abs)
    away = [np.abs((marks - start - shift + 0.5 * step) % step - 0.5 * step) for shift in shifts]
    return start + float(shifts[int(np.argmin([(near < _MARK_ROOM).sum() for near in away]))])


PageSize = Literal["A4", "A3", "Letter"]
_PAGE_SIZES = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "Letter": (215.9, 279.4)}  # mm, ISO 216 and ANSI Y14.1
_MAX_CUBIC_SWEEP = math.radians(15.0)  # rad; a cubic over it deviates from the arc by 6e-9 of the radius
_POINTS_PER_MM = 72.0 / 25.4
_BLEED_WIDTH = 4.0  # mm; width printed beyond a window


def to_pdf(sheets: Sequence[CutSheet], page: PageSize = "A4", title: str = "coneskin") -> bytes:
    """Write cut sheets as one PDF: a page map first, then the pages to print.

    Raises:
        GeometryError: an unknown paper size.
    """
    if page not in get_args(PageSize):
        raise GeometryError(f"page must be one of {', '.join(get_args(PageSize))}, got {page!r}")
    tiling = _tile_pages(sheets, *_PAGE_SIZES[page])
    pdf = _PdfWriter()
    font = pdf.add("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>")
    layers = [pdf.add(f"<< /Type /OCG /Name ({sheet.slug}) >>") for sheet in sheets]
    names = " ".join(f"/L{i} {layer} 0 R" for i, layer in enumerate(layers))
    resources = f"/Font << /F {font} 0 R >> /Properties << {names} >>"
    x0, y0, x1, y1 = tiling.extent
    box = " ".join(_pdf_number(value) for value in (x0 - 1, y0 - 1, x1 + 1, y1 + 1))
    drawing = pdf.add_stream(
        "\n".join(_drawing(sheets)),
        f"/Type /XObject /Subtype /Form /BBox [{box}] /Resources << {resources} >>",
    )
    shared = f"<< {resources} /XObject << /D {drawing} 0 R >> >>"
    box = f"[0 0 {_pdf_number(tiling.width * _POINTS_PER_MM)} {_pdf_number(tiling.height * _POINTS_PER_MM)}]"
    contents = [_map_page(tiling, sheets, f"{title} - {page}"), *_tiles(tiling, title)]
    for content in contents:
        stream = pdf.add_stream("\n".join([f"{_POINTS_PER_MM:.9f} 0 0 {_POINTS_PER_MM:.9f} 0 0 cm", *content]))
        pdf.add_page(f"/MediaBox {box} /Resources {shared} /Contents {stream} 0 R")
    order = " ".join(f"{layer} 0 R" for layer in layers)
    return pdf.finish(
        "/ViewerPreferences << /PrintScaling /None >> "
        f"/OCProperties << /OCGs [{order}] /D << /Order [{order}] /ON [{order}] >> >>",
        title,
    )


def _drawing(sheets: Sequence[CutSheet]) -> Iterator[str]:
    """Yield the drawing of all sheets in their own coordinates [mm]."""
    yield "0.2 w 1 J 1 j"
    for i, sheet in enumerate(sheets):
        yield f"/OC /L{i} BDC"
        for part in sheet.parts:
            for stroke in part.strokes:
                yield _rgb(LINE_COLOURS[stroke.kind], "RG")
                yield from _path(stroke.outline)
            for label in part.labels:
                yield _rgb(LINE_COLOURS["label"], "rg")
                yield _label(label)
        yield "EMC"


def _path(outline: Outline) -> Iterator[str]:
    def at(x: float, y: float) -> str:
        return f"{_pdf_number(x * 1e3)} {_pdf_number(y * 1e3)}"

    x0, y0, _ = outline.vertices[0]
    yield f"{at(x0, y0)} m"
    for segment in outline.segments():
        if segment.bulge == 0.0:
            yield f"{at(*segment.end)} l"
            continue
        for piece in segment.split(max(1, math.ceil(abs(segment.sweep) / _MAX_CUBIC_SWEEP - 1e-9))):
            first, second = piece.controls
            yield f"{at(*first)} {at(*second)} {at(*piece.end)} c"
    yield "s" if outline.closed else "S"


def _label(label: PartLabel) -> str:
    c, s = math.cos(label.angle), math.sin(label.angle)
    back, down = -0.5 * label.width, -0.5 * label.height
    x, y = label.x + back * c - down * s, label.y + back * s + down * c
    return _text(label.text, x * 1e3, y * 1e3, label.height * 1e3, c, s)


def _text(text: str, x: float, y: float, height: float, c: float = 1.0, s: float = 0.0) -> str:
    turn = " ".join(_pdf_number(value) for value in (c, s, -s, c, x, y))
    return f"BT /F {_pdf_number(height / CAP_HEIGHT)} Tf {turn} Tm ({_escaped(text)}) Tj ET"


def _rgb(colour: tuple[int, int, int], operator: str) -> str:
    return " ".join(_pdf_number(value / 255.0) for value in colour) + f" {operator}"


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    return f"{_pdf_number(x0)} {_pdf_number(y0)} m {_pdf_number(x1)} {_pdf_number(y1)} l S"


def _scale_bar(x: float, y: float) -> Iterator[str]:
    """Yield a scale bar with 100 mm between the left edges of its first and last tick."""
    yield "0 0 0 rg 0 0 0 RG 0.2 w 0 J"
    yield _line(x, y, x + 100.0, y)
    for ten in range(11):
        yield _line(x + 10.0 * ten, y, x + 10.0 * ten, y + (4.0 if ten % 5 == 0 else 2.5))
    yield _text("100 mm - measure before cutting", x + 104.0, y, 2.2)


def _tiles(tiling: _PageTiling, title: str) -> Iterator[list[str]]:
    width, height = tiling.window
    count = len(tiling.cells)
    for page, (column, row) in enumerate(tiling.cells, start=1):
        left, bottom = _SIDE_MARGIN, _BOTTOM_MARGIN
        x, y = tiling.origin[0] + column * width, tiling.origin[1] + row * height
        bleed = _BLEED_WIDTH
        clip = " ".join(map(_pdf_number, (left - bleed, bottom - bleed, width + 2 * bleed, height + 2 * bleed)))
        content = ["q", f"{clip} re W n", f"1 0 0 1 {_pdf_number(left - x)} {_pdf_number(bottom - y)} cm /D Do", "Q"]
        content += _crop_marks(left, bottom, width, height)
        for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            mid_x, mid_y = left + 0.5 * (1 + dx) * width, bottom + 0.5 * (1 + dy) * height
            if (column + dx, row + dy) in tiling.cells:
                content += _registration(mid_x, mid_y)
                neighbour = tiling.cells.index((column + dx, row + dy)) + 1
                content.append(_neighbour(neighbour, mid_x, mid_y, dx, dy))
        where = f"page {page} of {count}, column {column + 1}, row {tiling.counts[1] - row}"
        yield [*content, *_scale_bar(left, 8.0), _text(f"{title} - {where}", left, 4.0, 2.2)]


def _neighbour(page: int, x: float, y: float, dx: int, dy: int) -> str:
    """Return the number of the adjacent page, just beyond the bleed, inside the printable area."""
    if dx:
        return _text(f"page {page}", x + (6.5 if dx > 0 else -4.7), y + 4.0, 1.8, 0.0, 1.0)
    return _text(f"page {page}", x + 4.0, y + (4.7 if dy > 0 else -6.5), 1.8)


def _crop_marks(left: float, bottom: float, width: float, height: float) -> Iterator[str]:
    yield "0 0 0 RG 0 0 0 rg 0.1 w 0 J"
    for x, out_x in ((left, -1.0), (left + width, 1.0)):
        for y, out_y in ((bottom, -1.0), (bottom + height, 1.0)):
            yield _line(x + out_x * 5.0, y, x + out_x * 9.0, y)
            yield _line(x, y + out_y * 5.0, x, y + out_y * 9.0)


def _registration(x: float, y: float) -> Iterator[str]:
    """Yield a slanted cross in a ring, unlike a mark to touch, on the border of two windows: half is on each page."""
    yield _line(x - 2.5, y - 2.5, x + 2.5, y + 2.5)
    yield _line(x - 2.5, y + 2.5, x + 2.5, y - 2.5)
    yield from _path(circle_outline(1e-3 * x, 1e-3 * y, 2e-3))


def _map_page(tiling: _PageTiling, sheets: Sequence[CutSheet], title: str) -> list[str]:
    """Return the overview page: a map of the pages, the materials, and how to print."""
    left, bottom = _SIDE_MARGIN, _BOTTOM_MARGIN
    width, height = tiling.window
    content = ["0 0 0 rg 0 0 0 RG", _text(title, left, bottom + height - 6.0, 5.0)]
    pages = "One page follows" if len(tiling.cells) == 1 else f"{len(tiling.cells)} pages follow"
    notes = [
        f"Print at 100 %, without scaling. {pages}. The bar below must measure 100 mm.",
        "Cut at the crop marks and join the pages edge to edge; the crosses must meet. Empty pages are left out.",
        "Red: cut. Magenta: hole. Blue: mark, do not cut. Green: fold. Layers can be hidden in the viewer.",
        *(f"{sheet.slug}: {sheet.material}, {sheet.face} face up" for sheet in sheets),
    ]
    y = bottom + height - 16.0
    for note in notes:
        content.append(_text(note, left, y, 2.2))
        y -= 4.5
    columns, rows = tiling.counts
    scale = min(width / (columns * tiling.window[0]), (y - bottom) / (rows * tiling.window[1]))
    x, y = left, y - scale * rows * tiling.window[1]
    shift_x, shift_y = x - scale * tiling.origin[0], y - scale * tiling.origin[1]
    move = f"{scale:.6f} 0 0 {scale:.6f} {_pdf_number(shift_x)} {_pdf_number(shift_y)} cm"
    content += ["q", move, "/D Do", "Q", "0.5 0.5 0.5 RG 0.2 w"]
    for page, (column, row) in enumerate(tiling.cells, start=1):
        cell_x, cell_y = x + scale * column * width, y + scale * row * height
        content.append(" ".join(map(_pdf_number, (cell_x, cell_y, scale * width, scale * height))) + " re S")
        content.append("0.5 0.5 0.5 rg")
        content.append(_text(str(page), cell_x + 1.5, cell_y + 1.5, min(5.0, 0.2 * scale * height)))
    content += _scale_bar(left, 8.0)
    return content
