"""Table 2 and figures 16 and 17: what the model leaves of them, and what that hangs on."""

from __future__ import annotations

import numpy as np
import pytest

from coneskin.skin.field.paper_experiment import (
    POINT_CONTACT,
    Effects,
    assumptions,
    experiment,
    lead_errors,
    sensitivities,
)
from coneskin.skin.field.paper_tables import decode_errors, paper_model

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
    from coneskin.skin.field.paper_pictures import draw_experiment, draw_places, draw_sensitivities

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
