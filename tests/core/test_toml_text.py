"""A mistake in a TOML text: its line, and what was meant."""

import re

import pytest

from coneskin.core.errors import SceneError
from coneskin.core.toml_text import parse_toml
from coneskin.scene.reader import parse_scene

MISTAKES = [
    ("[arm]\nmodel = UR5e", "line 2, 'model = UR5e': a text needs quotation marks"),
    ("[arm]\nhost = 10.0.0.2", "line 2, 'host = 10.0.0.2': a text needs quotation marks"),
    ("port = /dev/ttyUSB0", "a text needs quotation marks"),
    ("model = “UR5e”", "quotation marks are straight"),
    ("kind: 'stop'", 'write "=" between a key and its value'),
    ("// a remark", "a remark begins with #"),
    ("slider_stop = True", "write true or false"),
    ("table_z_mm = None", "leave out a key"),
    ("x = .5", "digits on both sides"),
    ("x = 5.", "digits on both sides"),
    ("x = 1,5", "a number has a point"),
    ("id = 01", "a whole number begins with no 0"),
    ("height_mm = 240 mm", "a value has no unit"),
    ('file = "C:\\Users"', 'write "/"'),
    ("x =", 'write a value behind "="'),
    ("x = # none", 'write a value behind "="'),
    ("[arm", "a table begins with [name]"),
    ("nonsense", "write a line as: key = value"),
    ("[arm]\n[arm]", "Cannot declare ('arm',) twice (at line 2, column 5): a key or table stands once"),
    ("[link]\n[[link]]", "each of several tables begins with [[name]]"),
    ("x = [1, 2 3]", "separate values by commas"),
    ("x = { y = 1", "close the bracket"),
    ("x = 'a", "close the text"),
    ('x = "a', "close the text"),
    ('x = "a\ny = 1', "close the text"),
    ("x = " + "[" * 100_000, "nested too deep"),
    ("x = " + "9" * 5000, "5000 digits"),
]


@pytest.mark.parametrize(("text", "said"), MISTAKES, ids=[said for _, said in MISTAKES])
def test_a_mistake_says_its_line_and_what_was_meant(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse_toml(text)


def test_a_long_line_is_shown_in_part() -> None:
    with pytest.raises(ValueError, match=r"line 1, 'word = x{53}\.\.\.': a text needs") as caught:
        parse_toml(f"word = {300 * 'x'}")
    assert len(str(caught.value)) < 150


@pytest.mark.parametrize(
    ("host", "alone"),
    [
        ("tcp://10.0.0.2", "10.0.0.2"),
        ("10.0.0.2:30004", "10.0.0.2"),
        ("http://robot.local:80/x", "robot.local"),
        ("10.0.0.2/", "10.0.0.2"),
    ],
)
def test_a_host_with_a_scheme_a_port_or_a_path_is_told_what_to_write(host: str, alone: str) -> None:
    with pytest.raises(SceneError, match=f'write "{alone}": the ports are those of the arm') as caught:
        parse_scene(f'[arm]\nmodel = "UR5e"\nhost = "{host}"\n')
    assert repr(host) in str(caught.value)


@pytest.mark.parametrize("host", ["::1", "fe80::1", "robot", "10.0.0.2"])
def test_a_name_and_an_address_of_either_kind_are_hosts(host: str) -> None:
    scene = parse_scene(f'[arm]\nmodel = "UR5e"\nhost = "{host}"\n')
    assert scene.arm is not None
    assert scene.arm.host == host
