"""PDF files: read back, compared with the DXF of the same sheet, and rendered and measured."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.cut_sheet import CutPart, CutSheet, Stroke, cut_sheets, nest_sheets
from coneskin.geometry.drawing.dxf import to_dxf
from coneskin.geometry.drawing.electrode_layout import lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.drawing.outline import Outline
from coneskin.geometry.drawing.pdf import _scale_bar, _tile_pages, to_pdf
from coneskin.geometry.frustum import Frustum
from tests.support.sweep import sweep

from ..drawing_readers import pdf_objects, read_dxf, read_pdf
from ..sheet_cases import SHEETS

AGREE = 1e-3  # mm, the promise; the file holds 1e-5 mm


@pytest.mark.parametrize("name", sweep(SHEETS, short=3))
@pytest.mark.long
def test_pdf_and_dxf_agree(name):
    sheets = cut_sheets(lay_out_sheet(SHEETS[name]), PAPER_STACK, overlap=0.0 if "disc" in name else 0.008)
    worst = 0.0
    for one, two in zip(read_dxf(to_dxf(sheets)), read_pdf(to_pdf(sheets)), strict=True):
        assert one.closed == two.closed
        pieces = iter(two.curves)
        for curve in one.curves:
            last = None
            while last is None or abs(last(1.0) - curve(1.0)) > 1e-4:  # an arc is several cubics
                before, last = last, next(pieces)
                start = curve(0.0) if before is None else before(1.0)
                worst = max(worst, abs(last(0.0) - start))
                for t in (0.2, 0.5, 1.0):  # at 0.2 a cubic is furthest from its arc
                    where = project(curve, last(t))
                    worst = max(worst, abs(curve(where) - last(t)))
        assert next(pieces, None) is None
    assert worst < AGREE


def project(curve, point):
    """Parameter of the nearest point of a line or an arc, by bisection on the distance along it."""
    low, high = 0.0, 1.0
    for _ in range(60):
        third = (high - low) / 3.0
        if abs(curve(low + third) - point) < abs(curve(high - third) - point):
            high -= third
        else:
            low += third
    return 0.5 * (low + high)


@pytest.mark.parametrize("wrap", [1.2, 2.0 * np.pi])
def test_no_mark_to_touch_lies_where_pages_join(wrap):
    cover = cut_sheets(lay_out_sheet(Frustum(0.05, 0.05, 0.3, wrap)), PAPER_STACK)[6]
    tiling = _tile_pages([cover], 210.0, 297.0)
    assert len(tiling.cells) > 1
    boxes = 1e3 * np.array([s.outline.bounds for part in cover.parts for s in part.strokes if s.kind == "score"])
    marks = [box for box in boxes.reshape(-1, 2, 2) if np.ptp(box, axis=0).max() < 5.0]
    assert len(marks) == 18, "two lines of each cross"
    for mark in marks:
        for at, origin, step, count in zip(mark.mean(axis=0), tiling.origin, tiling.window, tiling.counts, strict=True):
            joins = origin + step * np.arange(1, count)
            assert np.all(np.abs(joins - at) >= 8.0)
    for low, high, origin, step, count in zip(
        tiling.extent[:2], tiling.extent[2:], tiling.origin, tiling.window, tiling.counts, strict=True
    ):
        assert origin <= low + 1e-9
        assert high <= origin + step * count + 1e-9


def test_layers_are_optional_content_and_printing_is_not_scaled():
    sheets = cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)
    objects = pdf_objects(to_pdf(sheets))
    catalogue = objects[1]
    assert "/PrintScaling /None" in catalogue
    assert re.search(r"/OCGs \[(\d+ 0 R ?){7}\]", catalogue)
    names = [re.search(r"/OCG /Name \((.*?)\)", body)[1] for body in objects.values() if "/OCG " in body]
    assert names == [sheet.slug for sheet in sheets]
    form = next(body for body in objects.values() if "/Subtype /Form" in body)
    assert form.count(" BDC") == form.count("EMC") == 7
    for body in objects.values():
        if "stream\n" in body:
            content = body[body.index("stream\n") + 7 : body.index("\nendstream")]
            assert int(re.search(r"/Length (\d+)", body)[1]) == len(content)


@pytest.mark.parametrize(("page", "size"), [("A4", {210.0, 297.0}), ("A3", {297.0, 420.0}), ("Letter", {215.9, 279.4})])
def test_pages_have_the_size_of_the_paper(page, size):
    objects = pdf_objects(to_pdf(cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)[:1], page))
    boxes = [
        re.search(r"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", body) for body in objects.values() if "/MediaBox" in body
    ]
    assert len(boxes) > 1
    for box in boxes:
        assert {round(float(side) * 25.4 / 72.0, 3) for side in box.groups()} == size


def test_windows_cover_the_drawing_and_meet_without_a_gap():
    sheets = nest_sheets(cut_sheets(lay_out_sheet(SHEETS["flipped"]), PAPER_STACK))
    data = to_pdf(sheets)
    windows = []
    for body in pdf_objects(data).values():
        clip = re.search(r"^([-\d. ]+) re W n\n1 0 0 1 ([-\d.]+) ([-\d.]+) cm /D Do", body, re.MULTILINE)
        if clip:
            x, y, w, h = (float(word) for word in clip[1].split())
            dx, dy = float(clip[2]), float(clip[3])
            windows.append((x + 4 - dx, y + 4 - dy, w - 8, h - 8))  # without the 4 mm of bleed
    for stroke in read_pdf(data):
        for curve in stroke.curves:
            for t in np.linspace(0.0, 1.0, 7):
                p = curve(t)
                slack = 0.6  # strokes are looked at every 0.5 mm; 4 mm beyond a window are printed too
                assert any(
                    x - slack <= p.real <= x + w + slack and y - slack <= p.imag <= y + h + slack
                    for x, y, w, h in windows
                )
    width, height = windows[0][2:]
    for x, y, w, h in windows:
        assert (w, h) == (width, height)
        for origin, step, here in ((windows[0][0], width, x), (windows[0][1], height, y)):
            assert (here - origin) / step == pytest.approx(round((here - origin) / step), abs=1e-5)


def rendered(data, page, dpi, folder):
    """A page as an array of grey, darkest 0."""
    if shutil.which("pdftoppm") is None:
        pytest.skip("pdftoppm (poppler-utils) is not installed")
    (folder / "sheet.pdf").write_bytes(data)
    command = ["pdftoppm", "-r", str(dpi), "-f", str(page), "-l", str(page), "-gray", "-singlefile"]
    subprocess.run([*command, str(folder / "sheet.pdf"), str(folder / "page")], check=True, capture_output=True)
    header, rest = (folder / "page.pgm").read_bytes().split(b"\n255\n", 1)
    width, height = (int(word) for word in header.split()[-2:])
    return np.frombuffer(rest, np.uint8).reshape(height, width)


def dark_columns(row):
    """Centres of the runs of dark pixels."""
    dark = np.flatnonzero(row < 128)
    runs = np.split(dark, np.flatnonzero(np.diff(dark) > 1) + 1)
    return [0.5 * (run[0] + run[-1] + 1) for run in runs if len(run)]


@pytest.mark.parametrize("page", ["A4", *(pytest.param(page, marks=pytest.mark.long) for page in ("A3", "Letter"))])
@pytest.mark.long
def test_scale_bar_of_a_rendered_page_measures_100_mm(page, tmp_path):
    dpi = 600
    data = to_pdf(cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)[:1], page)
    for number in (1, 2):  # the map and the first page to print
        image = rendered(data, number, dpi, tmp_path)
        per_mm = dpi / 25.4
        # 3.5 mm above the bar, which is 8 mm above the lower edge, only the ticks at 0, 50 and 100 mm are cut
        row = image[image.shape[0] - round((8.0 + 3.5) * per_mm)]
        ticks = dark_columns(row[: round(120 * per_mm)])
        assert len(ticks) == 3
        assert (ticks[2] - ticks[0]) / per_mm == pytest.approx(100.0, abs=1.5 / per_mm)  # a pixel and a half


def test_the_scale_bar_has_a_tick_each_10_mm_and_none_beyond_its_end():
    drawn = [[float(word) for word in re.findall(r"[\d.]+", line)] for line in _scale_bar(15.0, 8.0) if line[-1] == "S"]
    bar, *ticks = drawn
    assert bar == [15.0, 8.0, 115.0, 8.0]
    assert [tick[0] for tick in ticks] == [tick[2] for tick in ticks] == [*range(15, 116, 10)]


def test_a_rendered_square_has_its_size(tmp_path):
    """What the drawing says in metres is on paper in millimetres, through the window of a page."""
    square = Outline(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.1, 0.0), (0.0, 0.1, 0.0)))
    part = CutPart("square", (Stroke("score", square),), ())
    sheet = CutSheet(1, "square", "paper", "outside", Frustum(0.05, 0.05, 0.1), (part,))
    dpi = 600
    image = rendered(to_pdf([sheet]), 2, dpi, tmp_path)
    per_mm = dpi / 25.4
    middle = image[round((14.0 + 0.5 * (297 - 38)) * per_mm) - round(20 * per_mm)]  # off the registration marks
    edges = dark_columns(middle)
    assert (edges[-1] - edges[0]) / per_mm == pytest.approx(100.0, abs=1.5 / per_mm)


def test_unknown_paper():
    with pytest.raises(GeometryError, match="page must be one of A4, A3, Letter, got 'A5'"):
        to_pdf(cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK), "A5")
