"""Command ``coneskin field``: numbers and pictures of one's own sensor, and what is refused."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from coneskin.cli import main
from coneskin.skin.field import pictures

CONE = ["--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150", "--wrap-deg", "300"]
CYLINDER = ["--radius1-mm", "54", "--height-mm", "434"]


def test_numbers_of_a_cylinder_are_those_by_hand(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["field", *CYLINDER, "--no-pictures", "--json", "--grid", "5", "--lower-ohm", "2000"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["radial_ohm"] == pytest.approx(1000.0 * 434.0 / 339.292, rel=1e-5)  # 2 pi 54 mm around
    assert facts["angular_ohm"] == pytest.approx(2000.0 * 339.292 / 434.0, rel=1e-5)
    assert 0.1 < facts["largest_u_error_mm"] < 5.0  # contacts of 5 mm beside the corners, at worst
    assert facts["pictures"] == []


@pytest.mark.long
@pytest.mark.parametrize("cone", [CONE, CYLINDER], ids=("sector", "rectangle"))
def test_every_picture_is_drawn(cone: list[str], tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(pictures, "_GRID_COUNT", 21)
    monkeypatch.setattr(pictures, "_LINE_STEPS", 12)
    figures, painted, make, paint = [], [], pictures.make_figure, pictures.paint_error

    def make_figure(*values):
        figures.append((made := make(*values))[0])
        return made

    monkeypatch.setattr(pictures, "make_figure", make_figure)
    monkeypatch.setattr(pictures, "paint_error", lambda *values: painted.append(values) or paint(*values))
    assert main(["field", *cone, "-o", str(tmp_path / "new"), "--grid", "4"]) == 0
    names = sorted(path.name for path in (tmp_path / "new").iterdir())
    assert names == ["error_phi.png", "error_u.png", "potential_angular.png", "potential_radial.png"]
    for sheet, u, phi, error, _ in painted:
        assert u[0] + u[-1] == pytest.approx(sheet.width)
        assert phi[0] + phi[-1] == pytest.approx(sheet.wrap)
        assert np.isfinite(error).all()
    scales = [figure.axes[1] for figure in figures if len(figure.axes) > 1 and "V" in figure.axes[1].get_ylabel()]
    assert len(scales) == 2
    for scale in scales:
        assert scale.get_yticks() == pytest.approx(np.linspace(*scale.get_ylim(), 6), abs=1e-9)


def test_a_mistake_is_named_without_a_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path
) -> None:
    (tmp_path / "file").touch()
    for words, message in (
        (("--lower-ohm", "-1", "--no-pictures"), "lower_resistance must be positive"),
        (("--grid", "1", "--no-pictures"), "--grid must be at least 2 points, got 1"),
        (
            ("--contact-mm", "300", "--no-pictures"),
            "--contact-mm must be above 0 mm and fit on the sensor, got 300.0 mm",
        ),
        (("--contact-mm", "0", "--no-pictures"), "--contact-mm must be above 0 mm"),
        (
            ("-o", str(tmp_path / "file" / "x"), "--grid", "2"),
            f"cannot make the folder {tmp_path}/file/x: Not a directory; name another",
        ),
    ):
        assert main(["field", *CYLINDER, *words]) == 1
        assert message in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert main(["field", *CYLINDER, "-o", str(tmp_path), "--grid", "2"]) == 1
    assert "pip install 'coneskin[pictures]'" in capsys.readouterr().err


def test_the_help_says_where_the_papers_figures_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["field", "--help"])
    assert "python demos/paper/paper_figures.py" in capsys.readouterr().out
