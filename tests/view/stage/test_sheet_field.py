"""The potential on a sheet: straight without a contact, and with one the level that was read."""

import math

import numpy as np
import pytest

from coneskin.runs.replay.run import read_run
from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.skin.sensor import Sensor
from coneskin.view.field_choice import (
    _PHASE_SHEETS,
    _UNIT_SQUARE,
    _as_light,
    _ContactOnSheet,
    _FieldPatches,
    _potential_colours,
    _SheetField,
)
from coneskin.view.stage.stage import SheetSurface
from tests.scene.scenes import DOUBLE_CONE
from tests.support.paths import COLLISION
from tests.view.browser import rotation

RUN = COLLISION


@pytest.fixture(scope="module")
def sensor() -> Sensor:
    return read_run(RUN).scene().sensors[0].sensor


def field_at(sensor: Sensor, *places: tuple[float, float]) -> _SheetField:
    u, phi = np.array(places).T
    return _SheetField(sensor, u, phi)


def test_the_driven_sheets_have_the_potentials_of_the_sensors_law(sensor: Sensor) -> None:
    """eq. 19 and 22, less what the leads of 1 ohm take: 1e-3 of the sheets' resistance."""
    cone = sensor.frustum
    places = [(0.1 * cone.slant, 0.2), (0.5 * cone.slant, 3.0), (0.9 * cone.slant, cone.wrap - 0.1)]
    field = field_at(sensor, *places)
    law = np.array([sensor.fractions(*place) for place in places]) * sensor.electronics.supply_volts
    for column, what in enumerate(("radial phase, upper sheet", "angular phase, lower sheet")):
        assert field.potentials(what, None) == pytest.approx(law[:, column], abs=3e-3 * field.supply)


@pytest.mark.parametrize("level", [0.05, 0.3, 0.78])
@pytest.mark.parametrize("place", [(0.4, 0.5), (0.01, 0.5), (0.5, 0.02)])
def test_the_guides_have_the_level_that_was_read(sensor: Sensor, place: tuple[float, float], level: float) -> None:
    """C and D are the edges of the lower sheet; the conductance is interpolated between tried ones 1.4 apart."""
    cone = sensor.frustum
    field = field_at(sensor, (0.5 * cone.slant, 0.0), (0.5 * cone.slant, cone.wrap))
    contact = _ContactOnSheet(place[0] * cone.slant, place[1] * cone.wrap, level)
    guides = field.potentials("touch phase, lower sheet", contact)
    assert guides.mean() == pytest.approx(level * field.supply, rel=0.03)


def test_a_touch_lowers_the_upper_sheet_where_it_is_and_raises_the_lower_one(sensor: Sensor) -> None:
    cone = sensor.frustum
    u, phi = np.meshgrid(np.linspace(0.0, cone.slant, 21), np.linspace(0.0, cone.wrap, 31), indexing="ij")
    field = _SheetField(sensor, u.ravel(), phi.ravel())
    contact = _ContactOnSheet(0.3 * cone.slant, 0.6 * cone.wrap, 0.6)
    for what, extreme in (("touch phase, upper sheet", np.argmin), ("touch phase, lower sheet", np.argmax)):
        at = int(extreme(field.potentials(what, contact)))
        assert (u.ravel()[at], phi.ravel()[at]) == pytest.approx(contact[:2])


@pytest.mark.parametrize("what", _PHASE_SHEETS)
@pytest.mark.parametrize(
    "contact", [None, _ContactOnSheet(-0.1, 9.0, 0.5), _ContactOnSheet(0.0, 0.0, 0.5), _ContactOnSheet(0.1, 1.0, 1.0)]
)
def test_a_place_beyond_an_edge_and_a_short_are_drawn_all_the_same(
    sensor: Sensor, what: str, contact: _ContactOnSheet | None
) -> None:
    found = field_at(sensor, (0.05, 1.0), (0.1, 2.0)).potentials(what, contact)
    assert np.isfinite(found).all()
    assert found.min() >= -1e-9
    assert found.max() <= sensor.electronics.supply_volts * (1.0 + 1e-9)


def test_the_same_contact_is_not_solved_twice(sensor: Sensor) -> None:
    field = field_at(sensor, (0.05, 1.0))
    contact = _ContactOnSheet(0.1, 1.0, 0.5)
    first = field.potentials("touch phase, lower sheet", contact)
    assert field.potentials("touch phase, lower sheet", _ContactOnSheet(0.1 + 1e-5, 1.0, 0.5)) is first
    assert field.potentials("touch phase, lower sheet", _ContactOnSheet(0.12, 1.0, 0.5)) is not first
    assert math.isfinite(float(first[0]))


def test_the_corners_of_the_patches_lie_above_the_sheet_and_cover_it() -> None:
    scene = parse_scene(DOUBLE_CONE, "scene.toml")
    for item, placed in zip(place_on_arm(scene), scene.sensors, strict=True):
        sheet = SheetSurface.of(item, placed.sensor)
        patches = _FieldPatches.of(sheet)
        square = np.array(_UNIT_SQUARE[0])
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
    colours = _potential_colours(np.linspace(1.0, 2.0, 400), 1.0, 2.0)
    assert len(np.unique(colours, axis=0)) == 20
    assert tuple(colours[0]) == (49, 18, 92)
    assert tuple(colours[-1]) == (250, 224, 60)
    assert _potential_colours(np.array([0.0, 9.0]), 1.0, 2.0).tolist() == [list(colours[0]), list(colours[-1])]


def test_colours_as_light() -> None:
    """IEC 61966-2-1: black and white stay, half of the light is 188 on the screen."""
    assert _as_light(np.array([[0, 188, 255]], dtype=np.uint8)).tolist() == [[0, 128, 255]]
