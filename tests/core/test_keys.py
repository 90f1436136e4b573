"""Keys, units and messages of the tables."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.keys import Key, check

KEYS = (
    Key("length_mm", low=1.0, high=500.0),
    Key("turn_deg", float, math.pi, low=0.0, high=360.0, above=True),
    Key("count", int, 3, low=0, high=10),
    Key("word", str, "a", choices=("a", "b")),
    Key("flag", bool, False),
    Key("place_mm", list, (0.0, 0.0), low=-10.0, high=10.0, length=2),
    Key("item", dict, ()),
)


def complaints(table: dict[str, Any], keys: tuple[Key, ...] = KEYS) -> list[str]:
    problems: list[str] = []
    check(table, keys, "thing", problems)
    return problems


def test_values_come_out_in_si_under_their_plain_names() -> None:
    problems: list[str] = []
    values = check({"length_mm": 250, "turn_deg": 90, "place_mm": [1, -2]}, KEYS, "thing", problems)
    assert problems == []
    assert values == {
        "length": 0.25,
        "turn": math.pi / 2,
        "count": 3,
        "word": "a",
        "flag": False,
        "place": (0.001, -0.002),
        "item": (),
    }


@pytest.mark.parametrize(
    ("name", "plain", "si"),
    [
        ("x_mm", "x", 0.007),
        ("x_mm_s", "x", 0.007),
        ("x_deg", "x", math.radians(7)),
        ("x_deg_s", "x", math.radians(7)),
        ("x_deg_s2", "x", math.radians(7)),
        ("x_rad_s", "x", 7.0),
        ("x_rad_s2", "x", 7.0),
        ("x_ms", "x", 0.007),
        ("x_s", "x", 7.0),
        ("x_hz", "x", 7.0),
        ("x_ma", "x", 0.007),
        ("x_ohm", "x", 7.0),
        ("x_v", "x", 7.0),
        ("x_n", "x", 7.0),
        ("x", "x", 7.0),
    ],
)
def test_each_unit(name: str, plain: str, si: float) -> None:
    assert check({name: 7}, (Key(name),), "t", []) == {plain: pytest.approx(si, rel=1e-15)}


def test_a_full_turn_is_two_pi_to_the_last_bit() -> None:
    assert check({"x_deg": 360}, (Key("x_deg"),), "t", []) == {"x": 2.0 * math.pi}


def test_all_mistakes_at_once() -> None:
    table = {
        "length_mm": 0.25,
        "turn_deg": 0,
        "count": 2.5,
        "word": "c",
        "flag": 1,
        "place_mm": [1],
        "item": {},
        "sort": 1,
    }
    problems = complaints(table)
    assert len(problems) == len(table)
    for name in table:
        assert sum(name in line for line in problems) >= 1, name


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "thing: the key length_mm is missing"),
        ({"length_mm": 0.25}, "from 1 to 500 mm, got 0.25 mm: is that in metres? Then write 250"),
        ({"length_mm": 0.0001}, "from 1 to 500 mm, got 0.0001 mm"),
        ({"length_mm": 501}, "thing.length_mm must be from 1 to 500 mm, got 501.0 mm"),
        ({"length_mm": math.nan}, "got nan mm"),
        ({"length_mm": math.inf}, "got inf mm"),
        ({"length_mm": "250 mm"}, "thing.length_mm must be a number [mm], got '250 mm'"),
        ({"length_mm": True}, "must be a number [mm], got True"),
        ({"length_mm": 10**400}, "must be from 1 to 500 mm, got 1000"),
        ({"length_m": 0.25}, "unknown key length_m; did you mean length_mm?"),
        ({"length": 0.25}, "unknown key length; did you mean length_mm?"),
        ({"lenght_mm": 250}, "unknown key lenght_mm; did you mean length_mm?"),
        ({"zzz": 1}, "unknown key zzz; known: length_mm, turn_deg, count"),
        ({"turn_deg": 0}, "above 0 to 360 deg, got 0.0 deg"),
        ({"count": 11}, "a whole number from 0 to 10, got 11"),
        ({"count": True}, "a whole number from 0 to 10, got True"),
        ({"count": 0x10**5000}, "a whole number from 0 to 10, got something too large to print"),
        ({"word": "c"}, "one of a, b, got 'c'"),
        ({"word": 5}, "one of a, b, got 5"),
        ({"flag": "yes"}, "must be true or false, got 'yes'"),
        ({"place_mm": [1, "x"]}, "thing.place_mm[1] must be a number [mm], got 'x'"),
        ({"place_mm": [1, 11]}, "thing.place_mm[1] must be from -10 to 10 mm, got 11.0 mm"),
        ({"place_mm": 5}, "a list of 2 numbers, got 5"),
        ({"item": {}}, "a list of tables, in double brackets, got {}"),
        ({"item": [1]}, "a list of tables, in double brackets, got [1]"),
        ({"word": "x" * 1000}, "..."),
    ],
)
def test_a_mistake_says_key_rule_unit_and_value(table: dict[str, Any], words: str) -> None:
    problems = complaints({"length_mm": 250, **table} if table and "length" not in "".join(table) else table)
    assert any(words in line for line in problems), problems
    assert all(len(line) < 250 for line in problems)


def test_a_hint_is_given_only_where_it_would_help() -> None:
    (line,) = complaints({"length_mm": 0.0001})
    assert "metres" not in line


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.dates() | st.just(10**400),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@pytest.mark.long
@settings(max_examples=300)
@given(st.dictionaries(st.sampled_from([key.name for key in KEYS]) | st.text(), anything, max_size=8))
def test_whatever_a_table_holds_mistakes_are_collected_not_raised(table: dict[str, Any]) -> None:
    problems: list[str] = []
    values = check(table, KEYS, "thing", problems)
    unknown = [name for name in table if name not in {key.name for key in KEYS}]
    assert sum("unknown key" in line for line in problems) == len(unknown)
    for key in KEYS:
        wrong = any(f"thing.{key.name}" in line for line in problems)
        if key.name in table and not wrong:  # a value that is taken is finite, and within its range in SI
            value = values[key.plain]
            numbers = value if key.kind is list else [value] if key.kind is float else []
            factor = 1e-3 if key.suffix == "_mm" else math.pi / 180.0
            assert all(key.low * factor <= number <= key.high * factor for number in numbers)
        if key.default is not ...:
            assert key.plain in values


@given(st.floats(1.0, 500.0))
def test_conversion_costs_no_more_than_one_rounding(value: float) -> None:
    (si,) = check({"length_mm": value}, KEYS[:1], "thing", []).values()
    assert si * 1000.0 == pytest.approx(value, rel=3e-16)  # the factor, the product and this product round once each
