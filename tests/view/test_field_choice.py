"""Choice of a potential: for which contact the sheet's potential is drawn."""

from types import SimpleNamespace

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.view.field_choice import _contact_on

PLACE = PlacedFrustum(Frustum(0.05, 0.05, 0.2))
SHEET = SimpleNamespace(name="one", item=SimpleNamespace(frustum=PLACE))


def contact(sensor: str = "one", strength: float = 1.0, level: float = 0.3):
    mark = SimpleNamespace(sensor=sensor, strength=strength, point=PLACE.point(0.1, 1.0))
    return _contact_on(SHEET, SimpleNamespace(levels={"one": level}, marks=[mark]))  # type: ignore[arg-type]


def test_what_has_ended_or_presses_another_sheet_is_not_drawn() -> None:
    assert contact() == pytest.approx((0.1, 1.0, 0.3))
    assert contact(sensor="two") is contact(strength=0.9) is contact(level=0.0) is None
