"""File of a page: which file it replaces. What it shows is tested in a browser."""

from pathlib import Path

import pytest

from coneskin.core.errors import RecordingError
from coneskin.view.html_file import write_html
from coneskin.view.page_server import page_client
from coneskin.view.strand import read_strands
from tests.support.paths import COLLISION

RUN = COLLISION


def test_a_recording_is_not_replaced_by_a_page(tmp_path: Path) -> None:
    """`view --html runs/*/run.rec` names the first of them as the page."""
    named = tmp_path / "run.rec"
    named.write_bytes(RUN.read_bytes())
    with pytest.raises(RecordingError, match="exists already and is no page"):
        write_html(named, read_strands([RUN]))
    assert named.read_bytes() == RUN.read_bytes()


def test_a_page_is_replaced(tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is written")
    page = tmp_path / "run.html"
    page.write_text(page_client()[:200], encoding="utf-8")
    write_html(page, read_strands([RUN]))
    assert page.stat().st_size > 10_000
