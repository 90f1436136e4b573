"""What may go wrong between a figure and the disk is said the same way for every picture."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from coneskin.commissioning.acceptance.marks_picture import draw_marks
from coneskin.commissioning.calibration.residuals_picture import draw_residuals
from coneskin.core.errors import MissingExtra, RecordingError, SceneError
from coneskin.core.picture_file import write_picture
from coneskin.runs.replay.run_picture import draw_run
from coneskin.runs.what_if.variants import draw_variants

NOTHING: Any = SimpleNamespace(name="a scene")
PICTURES: dict[str, Callable[[Path], None]] = {
    "the picture of a run": lambda path: draw_run(NOTHING, path),
    "the picture of variants": lambda path: draw_variants([], path),
    "the picture of the marks": lambda path: draw_marks(NOTHING, NOTHING, None, path),
    "the picture of the residuals": lambda path: draw_residuals([], path),
}


@pytest.mark.parametrize("what", PICTURES)
def test_a_file_that_cannot_be_is_refused_before_anything_is_drawn(what: str, tmp_path: Path) -> None:
    with pytest.raises((RecordingError, SceneError), match=rf"{what} is a \.png, \.svg, \.pdf file, got .*\.gif"):
        PICTURES[what](tmp_path / "a.gif")
    with pytest.raises((RecordingError, SceneError), match=rf"{what} cannot be written to .*: there is no folder"):
        PICTURES[what](tmp_path / "no" / "a.png")


def write(path: Path, savefig: Callable[..., None]) -> None:
    write_picture(path, "the picture", lambda figure: setattr(figure, "savefig", savefig), RecordingError)


def fail(exc: Exception) -> Callable[..., None]:
    def savefig(*_: object, **__: object) -> None:
        raise exc

    return savefig


def test_errors_of_the_disk_and_of_the_scale_are_told_and_the_rest_is_ours(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    with pytest.raises(RecordingError, match=r"cannot be written to .*: No space left; name another file"):
        write(tmp_path / "a.png", fail(OSError(28, "No space left")))
    with pytest.raises(RecordingError, match="cannot be drawn: its times or values have no common scale: too large"):
        write(tmp_path / "a.png", fail(OverflowError("too large")))
    with pytest.raises(RecordingError, match=r"^ours$"):
        write(tmp_path / "a.png", fail(RecordingError("ours")))
    with pytest.raises(KeyError):
        write(tmp_path / "a.png", fail(KeyError("a mistake of ours")))


def test_without_matplotlib(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match="a picture needs the package matplotlib"):
        write(tmp_path / "a.png", fail(AssertionError()))
