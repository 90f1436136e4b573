"""Patches of a sheet lie on it, cover it, and have the colour of their potential."""

import numpy as np
import pytest

from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.view.stage.field_patches import SQUARE, field_patches, linear, potential_colours
from coneskin.view.stage.sheet_surface import sheet_surfaces

from ...scene.scenes import DOUBLE_CONE
from ..browser import rotation


def test_the_corners_of_the_patches_lie_above_the_sheet_and_cover_it() -> None:
    scene = parse_scene(DOUBLE_CONE, "scene.toml")
    for sheet in sheet_surfaces(place_on_arm(scene), [item.sensor for item in scene.sensors]):
        patches = field_patches(sheet)
        square = np.array(SQUARE[0])
        turns = np.array([rotation(wxyz) for wxyz in patches.rotations])
        corners = np.einsum("nij,nkj->nki", turns, square * patches.sizes[:, None, :]) + patches.positions[:, None, :]
        u, _, off = sheet.item.frustum.locate_all(corners)
        cone = sheet.item.frustum.frustum
        assert off.min() > 0.0015  # above the sheet as it is drawn, in spite of what a chord lies below its arc
        assert off.max() < 0.006
        assert (u.min(), u.max()) == pytest.approx((0.0, cone.slant), abs=0.05 * cone.slant)
        area = float((patches.sizes[:, 0] * patches.sizes[:, 1]).sum())
        assert area == pytest.approx(1.03**2 * cone.area, rel=0.1)  # 3.5 mm above the sheet it is larger


def test_colours_follow_the_potential_in_bands() -> None:
    colours = potential_colours(np.linspace(1.0, 2.0, 400), 1.0, 2.0)
    assert len(np.unique(colours, axis=0)) == 20
    assert tuple(colours[0]) == (49, 18, 92)
    assert tuple(colours[-1]) == (250, 224, 60)
    assert potential_colours(np.array([0.0, 9.0]), 1.0, 2.0).tolist() == [list(colours[0]), list(colours[-1])]


def test_colours_as_light() -> None:
    """IEC 61966-2-1: black and white stay, half of the light is 188 on the screen."""
    assert linear(np.array([[0, 188, 255]], dtype=np.uint8)).tolist() == [[0, 128, 255]]
