"""Draft of a file: the whole file or none, whatever happens between."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from coneskin.core.draft_file import draft_of


@contextmanager
def _half_a_draft(path: Path) -> Iterator[None]:
    with draft_of(path) as draft:
        draft.write_bytes(b"half")
        assert draft.exists()
        yield
        raise ZeroDivisionError


def test_a_draft_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "file"
    with pytest.raises(ZeroDivisionError), _half_a_draft(path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_draft_takes_the_place_of_a_file_only_where_it_may(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"mine")
    with pytest.raises(FileExistsError), draft_of(path) as draft:
        draft.write_bytes(b"other")
    assert path.read_bytes() == b"mine"
    with draft_of(path, overwrite=True) as draft:
        draft.write_bytes(b"other")
    assert path.read_bytes() == b"other"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_written_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, order = tmp_path / "file", []
    monkeypatch.setattr("coneskin.core.draft_file.os.fsync", lambda _: order.append(path.exists()))
    with draft_of(path) as draft:
        draft.write_bytes(b"all")
    assert order[:1] == [False]
