"""The keys bend_wrap_deg, bend_turn_deg and bend_lift_mm: a full wrap has to close, outwards."""

import pytest

from coneskin.core.errors import SceneError
from coneskin.scene.reader import parse_scene
from tests.support.scenes import forearm_scene


def scene(wraps: list[float], turns: list[float], more: str = "") -> str:
    keys = f"bend_wrap_deg = {wraps}\nbend_turn_deg = {turns}\n{more}height_mm"
    return forearm_scene().replace("radius2_mm = 37.2", "radius2_mm = 37.6").replace("height_mm", keys, 1)


@pytest.mark.parametrize(
    "turns",
    [
        [3.14159, 3.14159],  # radians
        [-180, -180],  # inside out: a retreat would press
        [0, 0],
        [360, 360],  # twice around
        [180, 90],
    ],
)
def test_a_full_wrap_that_does_not_close_outwards_is_refused(turns: list[float]) -> None:
    with pytest.raises(SceneError, match="the bends of a full wrap must close"):
        parse_scene(scene([180, 180], turns))


def test_one_that_closes_within_rounding_and_a_partial_one_are_taken() -> None:
    assert parse_scene(scene([90, 90, 90, 90], [119.9, 60, 120, 60])).sensors[0].placed.bends
    assert parse_scene(scene([60, 60], [20, -5], "wrap_deg = 120\n")).sensors[0].placed.bends


def test_a_lift_moves_the_rulings_of_a_cone_and_needs_bends() -> None:
    """The points stay on the normals of the side below, 3 mm above it: found by the distance of the two sides."""

    def cone(more: str) -> str:
        text = scene([60, 140], [20, 150], f"wrap_deg = 200\n{more}")
        return text.replace("radius2_mm = 37.6", "radius2_mm = 30")

    lifted, plain = (parse_scene(cone(more)).sensors[0].placed for more in ("bend_lift_mm = 3\n", ""))
    below = lifted.parallel(-0.003)
    assert below.lift == pytest.approx(0.0, abs=1e-15)
    assert below.frustum.radius1 == pytest.approx(lifted.frustum.radius1 - 0.003 * 170.0 / 200.0, rel=1e-12)
    assert lifted.point(0.1, 1.0) != pytest.approx(plain.point(0.1, 1.0), abs=1e-6)
    bads = (scene([], [], "bend_lift_mm = 3\n"), "a cone has none"), (cone("bend_lift_mm = 60\n"), "beyond its apex")
    for bad, message in bads:
        with pytest.raises(SceneError, match=message):
            parse_scene(bad)
