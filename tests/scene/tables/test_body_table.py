from __future__ import annotations

import pytest

from coneskin.core.errors import SceneError, SensorError
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import ArmScene
from coneskin.skin.materials import Padding
from tests.support.stored_energy import stored_energy

ARM = '[arm]\nmodel = "UR5e"\nhost = "127.0.0.1"\n'
HAND = ARM + '[[body]]\nkind = "hand"\nxyz_mm = [400, 0, 500]\nmass_kg = 0.6\nstiffness_n_per_mm = 75\n'


def test_a_body_is_read_in_si() -> None:
    (body,) = parse_scene(HAND).bodies
    assert (body.kind, body.mass) == ("hand", 0.6)
    assert body.place == pytest.approx((0.4, 0.0, 0.5))
    assert body.stiffness == pytest.approx(75e3)


def test_a_scene_without_bodies_has_none_and_padding_is_the_assumed_one() -> None:
    scene = parse_scene(ARM)
    assert scene.arm == ArmScene("UR5e", "127.0.0.1"), "what a table leaves out is as its class has it"
    assert (scene.bodies, scene.padding) == ((), None)
    assert parse_scene(ARM + "[padding]\n").padding == Padding()
    assert parse_scene(ARM + "[padding]\nthickness_mm = 8\n").padding == Padding(thickness=8e-3)


TABLE = "[padding]\ndepths_mm = [1, 2]\nforces_n = [5, 9.5]\n"


def test_a_padding_is_a_table_of_force_over_depth() -> None:
    padding = parse_scene(ARM + TABLE + "hard_n_per_mm = 500\n").padding
    assert padding is not None
    assert padding.table == ((0.001, 5.0), (0.002, 9.5))
    depths = (-1e-3, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3)
    assert [padding.elastic(depth) for depth in depths] == pytest.approx([0.0, 2.5, 5.0, 7.25, 9.5, 509.5])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HAND.replace("mass_kg = 0.6\n", ""), "a hand needs mass_kg"),
        (HAND.replace('"hand"', '"person"'), "a person needs force_n"),
        (HAND.replace('"hand"', '"wall"'), "a wall needs direction"),
        (HAND + "direction = [0, 0, 0]\n", "direction must not be 0, 0, 0"),
        (HAND.replace("[400, 0, 500]", "[0.4, 0]"), "xyz_mm must be a list of 3 numbers"),
        (HAND.replace(ARM, ""), r"\[\[body\]\] needs an \[arm\]"),
        (ARM + "[body]\nkind = 1\n", "body must be a list of tables"),
        (ARM + "[padding]\nthickness_mm = 0\n", "padding.thickness_mm"),
        (
            ARM + "[padding]\ndepths_mm = [1, 2]\nforces_n = [5]\n",
            "a force for each depth, got 2 depths_mm and 1 forces_n",
        ),
        (ARM + TABLE.replace("5, 9.5", "42, 60"), "forces_n must begin with at most 10 N, got 42 N"),
        (ARM + TABLE + "hard_n_per_mm = 1\n", "at least the last slope of the table, got 1 N/mm behind 4.5 N/mm"),
        (ARM + TABLE + "thickness_mm = 6\n", "depths_mm and forces_n stand in place of thickness_mm"),
        (ARM + TABLE.replace("9.5", "4"), "must rise, got 4 N at 2 mm after 5 N at 1 mm"),
        (
            ARM + TABLE.replace("9.5", "10.5"),
            "must at most double to the next depth, got 10.5 N at 2 mm .*: measure between",
        ),
        (ARM + TABLE + "spread = 1\n", "padding.spread"),
    ],
)
def test_mistakes_are_named(text: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        parse_scene(text)


def test_a_padding_is_a_spring_that_bottoms_out_and_never_pulls() -> None:
    padding = Padding(thickness=5e-3, stiffness=10e3, hard_stiffness=1e6, loss=0.5)
    assert padding.force(4e-3, 0.0) == pytest.approx(40.0)
    assert padding.force(6e-3, 0.0) == pytest.approx(50.0 + 1000.0)
    assert padding.force(4e-3, 0.2) == pytest.approx(40.0 * 1.1)
    assert padding.force(4e-3, -3.0) == 0.0
    assert padding.force(-1e-3, 1.0) == 0.0
    with pytest.raises(SensorError, match="thickness"):
        Padding(thickness=0.0)


@pytest.mark.parametrize("depth", [-1e-3, 2e-3, 5e-3, 8e-3])
def test_the_energy_of_a_padding_is_the_integral_of_its_force(depth: float) -> None:
    for padding in (Padding(thickness=5e-3), Padding(table=((1e-3, 5.0), (4e-3, 9.0), (7e-3, 17.0)))):
        steps = [padding.elastic(depth * (k + 0.5) / 20_000) * depth / 20_000 for k in range(20_000)]
        assert stored_energy(padding, depth) == pytest.approx(sum(steps), rel=1e-6, abs=1e-15)
