"""JSON of strangers: what is wrong with it is a ValueError, and no number overflows where it meets a float."""

import io
import json
import math
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from coneskin.core.recording.block import Block
from coneskin.core.text import painted, read_json
from coneskin.design.link_design import design_link
from coneskin.geometry.frustum import Frustum
from coneskin.robot.guard.signals.journal import BlockKind, body_places, contact_force, decode_event, stopping_contact
from coneskin.runs.replay.run import read_run
from coneskin.session.outcome import STANDS, stop_error
from tests.support.paths import COLLISION

ANY_TEXT = st.text(st.characters())  # half pairs of UTF-16 among them
VALUES = st.recursive(st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(), st.lists)


@pytest.mark.long
@given(VALUES)
def test_what_json_writes_is_read_as_it_was(value: Any) -> None:
    assert read_json(json.dumps(value).encode()) == value


@given(st.integers(-(10**99), 10**99))
@example(-(10**99))
def test_whole_numbers_of_a_hundred_digits_are_exact(value: int) -> None:
    found = read_json(b"%d" % value)
    assert (type(found), found) == (int, value)


def test_longer_whole_numbers_are_floats() -> None:
    assert read_json(b"1" + b"0" * 200) == 1e200
    assert read_json(b"1" * 400) == math.inf
    assert read_json(b"[-" + b"1" * 5000 + b"]") == [-math.inf]


@pytest.mark.long
@given(st.recursive(ANY_TEXT, lambda inner: st.lists(inner) | st.dictionaries(ANY_TEXT, inner), max_leaves=8))
@example("\udcff")
@example({"\ud800": ["\udfff"]})
def test_every_string_can_be_written_as_utf_8(value: Any) -> None:
    found = json.dumps(read_json(json.dumps(value).encode()), ensure_ascii=False)
    assert found.encode().decode() == found  # a lone half would raise


def test_half_a_pair_is_written_out_and_a_whole_one_is_its_letter() -> None:
    assert read_json(rb'["a\udcffb", "\\udcff", "\ud83e\udd16"]') == [r"a\udcffb", r"\udcff", "\N{ROBOT FACE}"]


@pytest.mark.parametrize("text", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"nothing", b'"\xed\xa0\x80"'])
def test_whatever_is_wrong_is_a_value_error(text: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_json(text)


def test_huge_numbers_of_a_recording_are_no_force_and_no_place() -> None:
    digits = b"1" * 400
    assert contact_force(b'{"contact_force_N": ' + digits + b"}") is None
    assert body_places(b'{"bodies_m": [[' + digits + b", 0, 0]]}") == ()


def test_an_event_with_a_huge_number_can_be_told() -> None:
    block = Block(BlockKind.EVENT, 1.0, b'["decelerating", {"speed": ' + b"1" * 400 + b"}]")
    assert f"{decode_event(block).details['speed']:.3f} rad/s" == "inf rad/s"


class Terminal(io.StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_colours_and_a_file_gets_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert painted("bad", "red", Terminal()) == "\033[31mbad\033[0m"
    assert painted("bad", "red", io.StringIO()) == "bad"


@pytest.mark.parametrize(("value", "wanted"), [("1", "ok"), ("", "\033[32mok\033[0m")])
def test_no_color_is_heeded_where_it_is_not_empty(value: str, wanted: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", value)
    assert painted("ok", "green", Terminal()) == wanted


class Page(HTMLParser):
    """The text of a page, and its elements."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words, self.elements = "", set[str]()
        self.feed(text)

    def handle_starttag(self, tag: str, _attributes: object) -> None:
        self.elements.add(tag)

    def handle_data(self, data: str) -> None:
        self.words += f" {data}"


def test_designs_runs_and_collisions_have_a_line_and_for_a_notebook_a_picture_a_table_and_the_next_step() -> None:
    run = read_run(COLLISION)
    stop = next(event for event in run.events if event.name == "stopping")
    collision = stop_error(stop, stopping_contact(stop, run.events), STANDS, "<b>")
    design = design_link(Frustum(0.04, 0.07, 0.15))
    for value, line, words in (
        (run, "<Run 'scene.toml': 2.1 s, 14 events, whole>", ("touch located", "run.replay()")),
        (collision, "<Collision 1: 'forearm skin' on 'forearm', u=130.0 mm, phi=89.0 deg", ("<b>", "session.reset(")),
        (design, "<LinkDesign 'a link by its dimensions': <SheetDesign 'sheet 1': radii 40.0", ("write_design(",)),
    ):
        assert repr(value).startswith(line)
        assert "\n" not in repr(value)
        assert len(repr(value)) < 200
        page = Page(value._repr_html_())
        assert {"table", "code"} < page.elements
        assert page.elements & {"svg", "img"}
        for said in words:
            assert said in page.words
