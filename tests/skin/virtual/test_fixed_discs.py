"""Fixed places scaled to any radius and conductance, against the full solve of each moment."""

from __future__ import annotations

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.virtual.field_contacts import _FixedDiscs

TUBE, CONE = Frustum(0.0376, 0.0373, 0.24), Frustum(0.04, 0.07, 0.15, 5.0)
U, PHI, LARGEST = np.array([0.08, 0.11, 0.04]), np.array([2.0, 2.35, 0.5]), np.array([0.0095, 0.0095, 0.008])


@pytest.mark.parametrize(
    ("link", "lower", "k"), [(TUBE, 1000.0, 1), (CONE, 300.0, 2), (TUBE, 300.0, 3), (CONE, 1000.0, 3)]
)
def test_any_force_is_the_full_solve(link: Frustum, lower: float, k: int) -> None:
    sheet = SectorSheet.of_frustum(link)
    places = _FixedDiscs.of(FieldModel(sheet, 1000.0, lower, 1e-7), U[:k], PHI[:k], LARGEST[:k])
    rng = np.random.default_rng(k)
    radius, conductance = LARGEST[:k] * rng.uniform(0.01, 1.0, (20, k)), 10 ** rng.uniform(-3, 5, (20, k))
    conductance[0] = np.inf
    model = FieldModel(sheet, 1000.0, lower, 1e-13)
    full = model.contacts(np.tile(U[:k], (20, 1)), np.tile(PHI[:k], (20, 1)), radius, conductance)
    got = places.coupling(radius, conductance)
    for name in ("conductance", "x", "y"):
        # The tolerance of 1e-7 chooses the order; measured: at most 2e-10.
        assert getattr(got, name) == pytest.approx(getattr(full, name), rel=1e-8)
    for name in ("xx", "xy", "yy"):
        limit = 1e-8 * np.max(full.xx + full.yy)
        assert getattr(got, name) == pytest.approx(getattr(full, name), abs=limit)


def test_reciprocal_and_without_net_current() -> None:
    model = FieldModel(SectorSheet.of_frustum(TUBE), 1000.0, 300.0)
    places = _FixedDiscs.of(model, U, PHI, LARGEST)
    y = model.admittance(places.coupling([[0.003, 0.002, 0.001]], [[1.0, 10.0, 100.0]]))[0]
    assert (y == y.T).all()
    assert np.abs(y.sum(axis=1)).max() < 1e-17  # entries are up to 1e-3 S


def test_what_cannot_be_is_refused() -> None:
    model = FieldModel(SectorSheet.of_frustum(TUBE), 1000.0, 300.0)
    with pytest.raises(FieldError, match="discs must not overlap"):
        _FixedDiscs.of(model, [0.08, 0.09], [2.0, 2.0], [0.006, 0.006])
    places = _FixedDiscs.of(model, [0.08], [2.0], [0.006])
    with pytest.raises(FieldError, match="radius of a contact must be above 0 and at most"):
        places.coupling([[0.007]], [[1.0]])
    with pytest.raises(FieldError, match="conductance of a contact must be above 0"):
        places.coupling([[0.005]], [[0.0]])
