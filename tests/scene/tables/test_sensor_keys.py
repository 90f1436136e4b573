"""The key table of a cone: the only place that names the keys, and what is derived from it agrees with it."""

import argparse
import ast
import tomllib
from pathlib import Path

import pytest

import coneskin
from coneskin.commands import design as design_command
from coneskin.commands import unroll as unroll_command
from coneskin.commands.dimensions import given_keys, option_name
from coneskin.core.errors import GeometryError
from coneskin.core.keys import Key, check
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.sheets.summary import design_summary, sensor_toml
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.scene.tables.sensor_keys import CONE_KEYS, DOUBLE_CONE_KEYS, LINK_CONE_KEYS, SENSOR_KEYS

SOURCE = Path(coneskin.__file__).parent
NAMES = {key.name for key in DOUBLE_CONE_KEYS}
TABLE = SOURCE / "scene" / "tables" / "sensor_keys.py"
#: the folder itself; geometry, skin and robot are links, and may not know of scenes
MODULES = sorted(
    path
    for folder in ("commands", "design", "scene", "session", "runs")
    for path in (SOURCE / folder).rglob("*.py")
    if path != TABLE
)


def named_keys(path: Path) -> set[str]:
    """Keys and options of the table that a module spells out: as a string of its own, or as a parsed argument."""
    words = {
        node.value if isinstance(node, ast.Constant) else node.attr
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
    }
    return {word for word in words if word.removeprefix("--").replace("-", "_") in NAMES}


def test_the_table_itself_would_be_found() -> None:
    """Otherwise the next test could not fail."""
    assert named_keys(TABLE) == NAMES


@pytest.mark.long
def test_no_other_module_spells_out_a_key() -> None:
    assert {path: named for path in MODULES if (named := named_keys(path))} == {}


def test_the_plain_names_are_the_attributes_of_a_frustum() -> None:
    values = {key.plain: 0.5 for key in CONE_KEYS}
    assert Frustum(**values) == Frustum(0.5, 0.5, 0.5, 0.5)
    assert {key.plain: key.default for key in CONE_KEYS if key.default is not ...} == {"wrap": Frustum(1, 1, 1).wrap}


def test_a_sensor_of_a_scene_has_the_keys_of_the_table() -> None:
    assert SENSOR_KEYS[: len(CONE_KEYS)] == CONE_KEYS


def options_of(command: object) -> dict[str, argparse.Action]:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)  # type: ignore[attr-defined]
    return {option: action for action in parser._actions for option in action.option_strings}


@pytest.mark.parametrize(("command", "keys"), [(unroll_command, LINK_CONE_KEYS), (design_command, DOUBLE_CONE_KEYS)])
def test_a_command_has_an_option_for_each_key(command: object, keys: tuple[Key, ...]) -> None:
    options = options_of(command)
    for key in keys:
        assert (options[option_name(key)].help or "").startswith(key.meaning)
    dimensions = {option for option in options if option.removeprefix("--").replace("-", "_") in NAMES}
    assert dimensions == {option_name(key) for key in keys}


@pytest.mark.parametrize("wrap", [Frustum(1, 1, 1).wrap, 4.5])
def test_what_a_design_writes_is_read_back_by_the_table(wrap: float) -> None:
    (design,) = design_sheets([PlacedFrustum(Frustum(0.04, 0.07, 0.15, wrap))], DesignOptions())
    table = tomllib.loads(sensor_toml(design, 0, "nothing"))
    problems: list[str] = []
    values = check({name: table[name] for name in table if name in NAMES}, CONE_KEYS, "t", problems)
    assert problems == []
    for key in CONE_KEYS:  # two conversions, a rounding each
        assert values[key.plain] == pytest.approx(getattr(design.active.frustum, key.plain), rel=4e-16)
        assert design_summary(design)["active_cone"][key.name] == pytest.approx(table[key.name], abs=5e-5)


def test_a_link_may_end_in_an_apex_and_a_sensor_may_not() -> None:
    given = {"radius1_mm": 0.0, "radius2_mm": 70.0, "height_mm": 150.0}
    assert given_keys(argparse.Namespace(**given), LINK_CONE_KEYS)["radius1"] == 0.0
    problems: list[str] = []
    check(given, CONE_KEYS, "sensor", problems)
    assert problems == ["sensor.radius1_mm must be from 1 to 5000 mm, got 0.0 mm"]


def test_a_dimension_in_metres_is_met_with_the_question() -> None:
    with pytest.raises(GeometryError, match=r"--height-mm must be .*got 0\.06 mm: is that in metres\? Then write 60"):
        given_keys(argparse.Namespace(radius1_mm=54.0, height_mm=0.06), LINK_CONE_KEYS)
