"""Pictures in space: what is nearer hides what is behind it, and each place has its own colour."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from coneskin.design import pictures
from coneskin.design.link_picture import _name_ends, _reasons, _View, draw_link, draw_weights
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.geometry.fit.bare_areas import BareArea
from coneskin.geometry.fit.touch_weights import TouchWeights
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose

figures = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
COLOURS = pytest.importorskip("matplotlib.colors")
RADIUS, LENGTH = 0.05, 0.2  # m


def tube(around: int = 80) -> Mesh:
    """An open tube about the z axis, twice as long as its sheet, which is in the middle of it."""
    phi = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)
    ring = np.stack([RADIUS * np.cos(phi), RADIUS * np.sin(phi)], axis=1)
    low, high = (np.column_stack([ring, np.full(around, z)]) for z in (-0.5 * LENGTH, 1.5 * LENGTH))
    one, two = np.arange(around), (np.arange(around) + 1) % around
    faces = np.concatenate(
        [np.stack([one, two, two + around], axis=1), np.stack([one, two + around, one + around], axis=1)]
    )
    return Mesh(np.concatenate([low, high]), faces)


def shares(axes: object, *names: str) -> list[float]:
    """The share of the drawn body in the hue of each colour, however bright."""
    picture = np.asarray(axes.images[0].get_array())  # type: ignore[attr-defined]
    drawn = picture[picture[..., 3] > 0.0][:, :3]
    hues = COLOURS.rgb_to_hsv(drawn)[:, 0]
    wanted = [COLOURS.rgb_to_hsv(COLOURS.to_rgb(name))[0] for name in names]
    return [float(np.mean(np.abs(hues - hue) < 0.01)) for hue in wanted]


@pytest.mark.long
def test_a_sheet_hides_the_link_under_it_and_bare_ends_have_the_colours_of_their_reasons() -> None:
    side = Frustum(RADIUS, RADIUS, LENGTH)
    designs = design_sheets([PlacedFrustum(side)], DesignOptions())
    samples = np.zeros((20, 3))
    ends = [BareArea(name, 0.25, samples + [0.0, 0.0, z]) for name, z in (("low", -0.1), ("high", 0.3))]
    figure = figures.Figure(figsize=(4, 4))
    draw_link(figure, designs, tube(), ends)
    for axes in figure.axes:
        sheet, low, high = shares(axes, "#2a7fb8", "#c3c8d0", "#ecd28b")
        assert sheet == pytest.approx(0.5, abs=0.08)  # the sheet is half as long, and wider by its thickness
        assert low == pytest.approx(0.23, abs=0.08)
        assert high == pytest.approx(0.23, abs=0.08)
    assert [line.get_label() for line in figure.axes[-1].lines][-2:] == ["bare, 25%: low", "bare, 25%: high"]


@pytest.mark.parametrize("fitted", [False, True])
def test_a_report_shows_deviations_and_bare_areas_where_there_are_any(
    fitted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A strip over the seam of a sheet lies on that sheet: the mesh below it is no deviation of a fit."""
    monkeypatch.setattr(pictures, "_draw_file", lambda *_: None)
    (sheet,) = design_sheets([PlacedFrustum(Frustum(RADIUS, RADIUS, 0.1, 2.0))], DesignOptions())
    designs = (sheet, replace(sheet, name="strip", above=sheet.name))
    figure = SimpleNamespace(placement=SimpleNamespace(faces=()), wires=(), collars=())
    mesh, bare = (tube(), [BareArea("flat", 0.1, np.zeros((1, 3)))]) if fitted else (None, [])
    drawn = pictures.draw_pictures(tmp_path, designs, [figure] * 2, mesh, 1e-3, lambda _: None, bare)  # type: ignore
    assert [path for _, path in drawn if "deviation" in path] == ["pictures/sheet-1-deviation.png"] * fitted
    assert ("tinted by its reason" in drawn[0][0]) is fitted


@pytest.mark.parametrize("way", [(0.8, 0.3, 0.4), (-0.8, -0.3, 0.4), (0.9, 0.1, -0.2)])
def test_the_line_from_the_name_of_an_end_does_not_cross_the_sheet_to_its_other_end(way: tuple[float, ...]) -> None:
    lying = Pose.from_xyz_rpy((0.0, 0.0, 0.0), (0.5 * math.pi, 0.0, 0.0))
    (design,) = design_sheets([PlacedFrustum(Frustum(RADIUS, RADIUS, 0.06), lying)], DesignOptions())
    axes = figures.Figure().add_subplot()
    _name_ends(axes, [design], _View(tube().moved(lying), way))
    one, two = sorted(axes.texts, key=lambda text: text.get_text())
    assert [one.get_text(), two.get_text()] == ["sheet 1, end 1", "sheet 1, end 2"]
    for text in (one, two):
        outwards = math.copysign(1.0, text.xy[0] - 0.5 * (one.xy[0] + two.xy[0]))
        assert outwards * (text.get_position()[0] - text.xy[0]) > 0.0, "the line leaves the sheet at once"


def test_a_place_has_the_reason_of_most_samples_near_it() -> None:
    line = np.column_stack([np.linspace(0.0, 1.0, 101), np.zeros((101, 2))])
    stray = np.array([[0.2, 0.0, 0.0], [0.21, 0.0, 0.0]])  # samples of the other reason amid these
    areas = [BareArea("a", 0.5, line[:50]), BareArea("b", 0.5, np.concatenate([line[50:], stray]))]
    assert _reasons(np.array([[0.2, 0.0, 0.0], [0.7, 0.0, 0.0]]), areas).tolist() == [0, 1]


@pytest.mark.long
def test_what_counts_is_drawn_in_the_colours_of_its_weights() -> None:
    """Half of a tube counts, half does not: each place has the colour of the nearest place of the map."""
    from matplotlib import colormaps

    figure = figures.Figure()
    designs = design_sheets([PlacedFrustum(Frustum(RADIUS, RADIUS, LENGTH))], DesignOptions())
    weights = TouchWeights(np.array([[0.05, 0.0, 0.1], [-0.05, 0.0, 0.1]]), np.array([4.0, 1.0]), "map.csv")
    draw_weights(figure, tube(), designs, weights)
    one, two, bar = figure.axes
    assert "map.csv" in bar.get_xlabel()
    for axes in (one, two):
        full, quarter = shares(axes, *(COLOURS.to_hex(colormaps["viridis"](value)) for value in (1.0, 0.25)))
        assert full + quarter > 0.9  # the rest are edges
        assert min(full, quarter) > 0.1
        assert len(axes.lines) == 4 * len(designs) + 1  # and the scale
