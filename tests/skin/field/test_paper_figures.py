"""The paper's figures and tables, from the demo that draws and prints them, and what the model leaves of Table 2."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from paper_experiment import POINT_CONTACT, Effects, assumptions, experiment, lead_errors, sensitivities
from paper_figures import main
from paper_tables import decode_errors, error_map, influence_of_area, paper_model, rows


def test_numbers_of_the_paper() -> None:
    table = {row.what: row for row in rows(paper_model())}
    wide = [row for row in table.values() if "15 mm and 10 deg" in row.what]
    assert [round(row.ours, 1) for row in wide] == [3.0, 2.0]  # the paper: 3.5 mm, 1.9 deg
    points = [row for row in table.values() if "fig. 11a" in row.what]
    assert points[0].ours < points[0].paper < points[1].ours  # its 0.06 mm lies between two plausible grids
    for row in (row for row in table.values() if row.what.startswith("table 2") and row.what.endswith(": r error")):
        assert -0.33 < row.ours < -0.27  # of -1.9 to -2.5
        assert "not reproduced" in row.verdict


def test_theta_error_vanishes_on_the_middle_line_and_is_odd_about_it() -> None:
    model = paper_model()
    _, theta = influence_of_area(model, np.array([1.0, 10.0, 20.0]), 150.0, 45.0)
    assert np.abs(theta).max() < 1e-12
    grid = error_map(model, 15.0, np.array([120.0, 150.0, 180.0]), np.array([20.0, 70.0]))
    assert np.allclose(grid.phi_error[:, 0], -grid.phi_error[:, 1], atol=1e-14)
    assert np.allclose(grid.u_error[:, 0], grid.u_error[:, 1], atol=1e-14)
    assert math.isnan(error_map(model, 15.0, np.array([110.0, 150.0]), np.array([45.0])).u_error[0, 0])


@pytest.mark.long
def test_demo_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--json", "--no-pictures"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["inferred"]["r2_mm"] == 200.0
    assert len(printed["rows"]) == 19
    assert printed["pictures"] == []
    assert [round(row["residual"], 2) for row in printed["rows"][-2:]] == [-1.83, -1.19]


class Drawn(NamedTuple):
    """What the demo has written, drawn and said."""

    folder: Path
    figures: dict[str, Any]
    out: str
    err: str


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Drawn:
    """One run with all pictures, which are small."""
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    folder, figures, save = tmp_path_factory.mktemp("demo") / "new", {}, module.Figure.savefig

    def savefig(self: Any, path: Path, **named: Any) -> None:
        figures[path.stem] = self
        save(self, path, **{**named, "dpi": 30})

    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(module.Figure, "savefig", savefig)
        assert main(["-o", str(folder), "--grid", "5"]) == 0
    return Drawn(folder, figures, out.getvalue(), err.getvalue())


@pytest.mark.long
def test_demo_draws_every_figure(drawn: Drawn) -> None:
    names = sorted(p.name for p in drawn.folder.iterdir())
    figures = [f"fig{n}.png" for n in ("04", "06", "09", "10", "11a", "11b", "11c", "12a", "12b", "12c", "16", "17")]
    assert names == [*figures, "table.csv", "table2.png"]
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in drawn.folder.glob("*.png"))
    with (drawn.folder / "table.csv").open(newline="") as file:
        table = {row["what"]: row for row in csv.DictReader(file)}
    assert [(row.what, row.verdict) for row in rows(paper_model())] == [(w, r["verdict"]) for w, r in table.items()]
    (line,) = [row for what, row in table.items() if what.startswith("fig. 11b") and "15 mm and 10 deg" in what]
    assert (line["paper"], line["unit"], round(float(line["ours"]), 4)) == ("3.5", "mm", 3.0051)
    assert float(line["residual"]) == pytest.approx(3.5 - 3.0051, abs=1e-4)
    assert "mean -1.90, spread 0.55; with r +0.17, with theta +0.00, with both -0.10" in drawn.out
    assert "Inferred, not given in the paper" in drawn.out
    assert "drawing" in drawn.err


@pytest.mark.long
def test_each_error_map_frames_the_areas_of_the_table(drawn: Drawn) -> None:
    """The picture reaches closer to the edges than the table, so it says both: its own largest error and theirs."""
    figures = drawn.figures
    for row in (row for row in rows(paper_model()) if " error, radius " in row.what):
        figure = figures[row.what[:8].replace(". ", "")]
        margins = row.what.rsplit(", ", 1)[1].replace(" and ", ", ")
        lines = {line.get_label(): line for line in figure.axes[0].lines}
        line = lines[f"{margins}: largest {row.ours:.4f} {row.unit}"]
        radius = np.hypot(*line.get_data())
        assert [radius.min(), radius.max()] == pytest.approx(
            [100 + float(margins.split()[0]), 200 - float(margins.split()[0])]
        )
        assert row.what.split(": ")[1].startswith(f"largest {'r' if row.unit == 'mm' else 'theta'} error")
    for name, bound in (("fig11b", 3.5), ("fig12b", 1.9)):  # the paper's largest error on the scale
        scale = figures[name].axes[1]
        marked = [float(line.get_ydata()[0]) for line in scale.lines]
        assert marked == [-bound, bound]
        assert scale.get_ylim()[1] >= bound
    (beside,) = figures["fig12c"].axes
    assert all(np.ptp(line.get_ydata()) > 0.01 for line in beside.lines), "deg: no panel of what is zero by symmetry"


@pytest.mark.long
def test_demo_names_a_mistake_without_a_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path
) -> None:
    (tmp_path / "file").touch()
    for words, message in (
        (("--ratio", "-1", "--no-pictures"), "lower_resistance must be positive"),
        (("--grid", "1", "--no-pictures"), "--grid must be at least 2"),
        (
            ("-o", str(tmp_path / "file" / "x")),
            f"cannot make the folder {tmp_path}/file/x: Not a directory; name another",
        ),
    ):
        assert main(words) == 1
        assert message in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert main(["-o", str(tmp_path)]) == 1
    assert "pip install 'coneskin[pictures]'" in capsys.readouterr().err


ROUNDING = np.array([0.05, 0.005])  # half a digit of the places of Table 2 [mm], [deg]


def test_no_offset_common_to_all_rows_explains_table_2() -> None:
    table = experiment(paper_model())
    assert table.spread == pytest.approx([0.549, 0.306], abs=1e-3)
    off = np.abs(table.residuals - table.residuals.mean(axis=0)).max(axis=0)
    assert (off > 5.0 * ROUNDING).all()
    # Nor an offset and a slope along each axis: what is left goes with both, in each.
    for axis in (0, 1):
        effects = Effects.of(table.places, table.residuals[:, axis])
        assert abs(effects.of_both) > 1.9 * ROUNDING[axis]


def test_effects_add_up_to_the_residuals() -> None:
    table = experiment(paper_model())
    found = Effects.of(table.places, table.residuals[:, 1])
    signs = np.sign(table.places - table.places.mean(axis=0))
    again = found.mean + found.of_r * signs[:, 0] + found.of_theta * signs[:, 1] + found.of_both * signs.prod(axis=1)
    assert again == pytest.approx(table.residuals[:, 1], abs=1e-12)


def test_leads_shrink_the_scale_by_their_share() -> None:
    """A point between leads of the share s is read at y + s over 1 + 2 s of the supply."""
    model, theta = paper_model(), np.array([20.0, 45.0, 70.0])
    _, off = lead_errors(model, np.full(3, 150.0), theta, 0.01)
    point = np.degrees(decode_errors(model, np.full(3, 0.15), np.radians(theta), 1e-3)[1])
    # The contact of 1 mm draws a little current too: 1 % of its own error and of the leads'.
    assert off == pytest.approx((theta + point + 0.9) / 1.02 - theta, abs=5e-4)
    assert np.sign(off).tolist() == [1.0, 0.0, -1.0] or abs(off[1]) < 1e-9


@pytest.mark.long
def test_no_assumption_about_the_sensor_brings_the_residuals_to_zero() -> None:
    found = {one.assumption.name: one for one in sensitivities()}
    assert len(found) == len(assumptions()) == 11
    for one in found.values():
        assert -2.3 < one.mean[0] < -1.7
        assert -1.2 < one.mean[1] < -0.9
        assert one.spread[0] > 4.0 * ROUNDING[0]
    base = found["as inferred"]
    assert (base.fig_11b_mm, base.fig_12b_deg) == pytest.approx((3.005, 1.9995), abs=1e-3)
    assert found["r1 = 90 mm"].fig_11b_mm > base.fig_11b_mm > found["r1 = 110 mm"].fig_11b_mm
    assert found["contact of ka = 1, not a bond"].fig_11b_mm < 0.15 * base.fig_11b_mm
    assert POINT_CONTACT == (1.6, 0.5)


@pytest.mark.long
def test_figure_17_shows_the_places_of_the_table(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    from paper_pictures import draw_experiment, draw_places, draw_sensitivities

    figures = {}
    monkeypatch.setattr(module.Figure, "savefig", lambda self, path, **_: figures.update({path.stem: self}))
    table, found = experiment(paper_model()), sensitivities()[:2]
    draw_places(tmp_path / "places.png", table)
    draw_experiment(tmp_path / "table.png", table)
    draw_sensitivities(tmp_path / "sensitivity.png", found)
    seen = {line.get_label(): line.get_data() for line in figures["places"].axes[0].lines}
    x, y = seen["seen by the paper's sensor"]
    places = np.stack([np.hypot(x, y), np.degrees(np.arctan2(y, x))], axis=1)
    # The paper's own places: (137.5 mm, 33.86 deg) and so on.
    assert places == pytest.approx(
        np.array([[137.5, 33.86], [137.7, 54.06], [158.1, 34.02], [157.9, 53.90]]), abs=0.011
    )
    bars = [patch.get_height() for patch in figures["table"].axes[0].patches[-4:]]
    assert bars == pytest.approx(table.residuals[:, 0])
    assert [tick.get_text() for tick in figures["sensitivity"].axes[0].get_yticklabels()] == [
        one.assumption.name for one in found
    ]
