"""Colours on a terminal, and none where nobody wants them."""

import io

import pytest

from coneskin.core.terminal_text import painted


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
