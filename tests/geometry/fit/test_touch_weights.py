"""Weights of touches: read, refused, laid over a link, and what they change about the sheets."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.fit.cones import find_cones
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.fit.touch_weights import LEAST_WEIGHT, TouchWeights, exposure_weights, read_touch_weights
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import TILTED, frustum, joined, moved, placed, revolve, shoulder
from .shared_fits import cones

HEAD = "x_mm,y_mm,z_mm,weight\n"
#: a thick tube and a thin one on one axis, with a groove between them that no sheet spans
STEPPED = revolve([(0.0, 0.05), (0.12, 0.05), (0.125, 0.02), (0.14, 0.02), (0.145, 0.04), (0.25, 0.04)], segments=64)


def test_places_are_read_in_millimetres_and_the_nearest_counts(tmp_path: Path) -> None:
    file = tmp_path / "map.csv"
    file.write_text("note, weight ,x_mm,y_mm,z_mm\na,2,0,0,0\nb,0.5,100,0,0\nc,0,0,200,0\n", encoding="utf-8")
    weights = read_touch_weights(file)
    assert weights.name == "map.csv"
    assert weights.points.max() == pytest.approx(0.2)
    there = weights.at(np.array([[0.0, 0.01, 0.0], [0.09, 0.0, 0.0], [0.0, 0.5, 0.0]]))
    assert there.tolist() == [1.0, 0.25, LEAST_WEIGHT]


@pytest.mark.parametrize("largest", [5e-324, 1e-310, 1.0, 1e308, 1.7976931348623157e308])
def test_only_the_ratio_of_weights_counts(largest: float, tmp_path: Path) -> None:
    """Up to the largest number and down to the smallest: no sum of them, no unit."""
    file = tmp_path / "map.csv"
    file.write_text(f"{HEAD}0,0,0,{largest!r}\n50,0,0,{largest!r}\n100,0,0,0\n", encoding="utf-8")
    weights = read_touch_weights(file)
    assert weights.at(np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.1, 0.0, 0.0]])).tolist() == [
        1.0,
        1.0,
        LEAST_WEIGHT,
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the columns x_mm, y_mm, z_mm, weight in its first line; x_mm, y_mm, z_mm, weight are missing"),
        ("x_mm,y_mm,z_mm\n1,2,3\n", "weight is missing"),
        (HEAD, "at least one place must have a weight above 0"),
        (HEAD + "0,0,0,0\n", "at least one place must have a weight above 0"),
        (HEAD + "0,0,0,1\n0,0,0,-1\n", "line 3: places must be finite and within"),
        (HEAD + "0,0,nan,1\n", "line 2: places must be finite"),
        (HEAD + "1e300,0,0,1\n", "line 2: places must be finite and within 10000 mm"),
        (HEAD + "0,0,0\n", "line 2 must have a number in each of x_mm, y_mm, z_mm, weight"),
        (HEAD + "0,0,0,much\n", "line 2 must have a number in each of"),
    ],
)
def test_a_wrong_map_is_refused_by_name_and_line(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "map.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(GeometryError, match=r"^\S*map\.csv: ") as error:
        read_touch_weights(file)
    assert words in str(error.value)


def test_a_map_that_is_no_text_or_not_there_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(GeometryError, match="this is not the text of a map of weights: byte 0 cannot stand in UTF-8"):
        read_touch_weights(tmp_path / "map.csv")
    with pytest.raises(GeometryError, match="No such file"):
        read_touch_weights(tmp_path / "none.csv")


def test_a_convex_body_is_exposed_everywhere_and_a_corner_less() -> None:
    mesh = placed(frustum(0.05, 0.04, 0.2))
    rays = RayCaster(mesh)
    assert exposure_weights(sample_surface(mesh, rays, 500), rays).weights.min() == 1.0
    mesh = placed(shoulder())
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, 3000)
    weights = exposure_weights(hull, rays).weights
    assert weights.min() < 0.75
    assert 0.1 < float((weights < 0.95).mean()) < 0.7


@pytest.mark.long
def test_the_floor_of_a_right_angled_groove_sees_what_the_formula_says() -> None:
    """At the middle of the floor of a long slot, w wide and d deep, the share of the sky is sin(atan(w / 2d))."""
    width, depth = 0.02, 0.02
    profile = [(0.0, 0.5), (0.3, 0.5), (0.3, 0.5 - depth), (0.3 + width, 0.5 - depth), (0.3 + width, 0.5), (0.6, 0.5)]
    mesh = placed(revolve(profile, segments=720))
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, 60_000)
    local = TILTED.inverse().apply_all(hull.points)
    floor = np.abs(np.hypot(local[:, 0], local[:, 1]) - 0.48) < 5e-4
    middle = hull.subset(floor & (np.abs(local[:, 2] - 0.31) < 0.001))
    assert len(middle) > 10
    lift = 0.002  # the rays start above the floor
    expected = math.sin(math.atan(0.5 * width / (depth - lift)))
    # 32 rays: a ray is 0.03
    assert float(exposure_weights(middle, rays).weights.mean()) == pytest.approx(expected, abs=0.03)


@pytest.mark.long
def test_the_sheet_goes_where_touches_count() -> None:
    mesh = placed(STEPPED)
    (plain,) = cones(mesh, max_sheets=1).sheets
    assert plain.frustum.radius1 == pytest.approx(0.05, abs=1e-4)
    assert plain.touch_share == plain.area_share
    places = TILTED.apply_all(np.array([[0.0, 0.0, 0.06], [0.0, 0.0, 0.21]]))
    fit = cones(mesh, max_sheets=1, weights=TouchWeights(places, np.array([0.1, 1.0]), "a map"))
    (sheet,) = fit.sheets
    assert fit.touch_weights is not None
    assert fit.touch_weights.name == "a map"
    assert sheet.frustum.radius1 == pytest.approx(0.04, abs=1e-4)
    assert sheet.frustum.height > 0.09
    assert sheet.touch_share > 0.6 > 0.5 > sheet.area_share
    # two sheets are allowed, but the thick tube adds too little that counts
    two = cones(mesh, weights=TouchWeights(places, np.array([0.0, 1.0])))
    assert len(two.sheets) == 1
    assert any("covers too little that counts" in area.reason for area in two.bare_areas)


@pytest.mark.long
def test_a_partial_wrap_turns_to_the_touched_side() -> None:
    """A wrap of a half turn on a whole tube may lie anywhere; with weights it lies where they are."""
    mesh = placed(frustum(0.05, 0.05, 0.2))
    for side in ((1.0, 0.0), (-0.6, 0.8)):
        out = np.array(TILTED.rotate((*side, 0.0)))
        base = TILTED.apply_all(np.array([[0.0, 0.0, 0.1]]))[0]
        weights = TouchWeights(np.array([base + 0.05 * out, base - 0.05 * out]), np.array([1.0, 0.2]))
        (sheet,) = cones(mesh, max_sheets=1, wrap=math.pi, weights=weights).sheets
        middle = np.array(sheet.placed.normal(0.5 * sheet.frustum.wrap))
        assert float(middle @ out) > math.cos(math.radians(5.0))


@pytest.mark.long
def test_equal_weights_change_nothing() -> None:
    mesh = placed(shoulder())
    plain = cones(mesh, max_sheets=1)
    same = cones(mesh, max_sheets=1, weights=TouchWeights(np.zeros((1, 3)), np.array([3.0])))
    assert [sheet.placed for sheet in plain.sheets] == [sheet.placed for sheet in same.sheets]


@pytest.mark.long
def test_exposure_prefers_the_open_side() -> None:
    """Two tubes alike, one of them beside a wall: without weights they tie, with exposure the free one is first."""
    tube = frustum(0.03, 0.03, 0.15, 64)
    wall, _ = revolve([(0.0, math.sqrt(0.5)), (1.0, math.sqrt(0.5))], segments=4)
    faces = revolve([(0.0, 1.0), (1.0, 1.0)], segments=4)[1]
    turn = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, math.sqrt(2.0)]]) / math.sqrt(2.0)
    slab = (wall @ turn.T * [0.01, 0.2, 0.16] + [0.045, 0.0, 0.0], faces)
    shifted = moved(tube, Pose.from_xyz_rpy((0.4, 0.0, 0.0), (0.0, 0.0, 0.0)))
    mesh = placed(joined(tube, slab, shifted))
    fit = find_cones(mesh, max_sheets=1, exposure=True)
    assert fit.touch_weights is not None
    assert fit.touch_weights.name == "exposure"
    place = TILTED.inverse().apply(fit.sheets[0].placed.link_frustum.translation)
    assert place[0] == pytest.approx(0.4, abs=1e-3)


def test_a_map_and_the_exposure_exclude_each_other() -> None:
    weights = TouchWeights(np.zeros((1, 3)), np.array([1.0]))
    with pytest.raises(GeometryError, match="from a map or from the exposure, not from both"):
        find_cones(placed(frustum(0.05, 0.05, 0.2, 24)), weights=weights, exposure=True)


def test_weights_are_checked() -> None:
    for points, values in itertools.product([np.zeros((1, 3))], [[math.nan], [-1.0], [1.0, 2.0]]):
        with pytest.raises(GeometryError):
            TouchWeights(points, np.array(values))


@pytest.mark.parametrize("places", [[[5.0, 0.0, 0.1]], [[5e-5, 0.0, 1e-4], [-5e-5, 0.0, 1e-4]]])
def test_places_beside_the_link_or_in_metres_are_refused(places: list[list[float]]) -> None:
    """They weighed every area of the link the same, and nobody was told."""
    turn = np.linspace(0.0, 6.0, 50)
    link = np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), np.linspace(0.0, 0.2, 50)], axis=1)
    with pytest.raises(GeometryError, match="must be in mm, in the frame of the mesh"):
        TouchWeights(np.array(places), np.ones(len(places))).check_place(link)
