"""Force to contact: threshold, delay, and a contact model that survives any script."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.errors import FieldError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.circuit import Contact, measure
from coneskin.skin.field_contact import FieldContacts, Foam, Layers, settled
from coneskin.skin.field_model import FieldModel
from coneskin.skin.field_sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual import ScriptedTouch, VirtualSkin

LINK = Frustum(0.05, 0.08, 0.2, 6.0)


def test_layers_close_at_the_papers_threshold() -> None:
    layers = Layers()
    assert layers.touch(0.5) == (0.0, 0.0)
    assert layers.touch(0.5 + 1e-9).siemens > 0.0
    assert layers.touch(1.5) == pytest.approx((4e-3, 200.0))
    # Hertz: eight times the force, twice the radius
    assert layers.touch(8.5).radius == pytest.approx(2 * layers.touch(1.5).radius)


def test_foam_delays_by_its_closed_form() -> None:
    foam, force, threshold = Foam(0.02, 0.6), 0.9, 0.5
    delay = foam.delay(force, threshold)
    assert foam.seated(foam.advance(0.0, force, delay), force) == pytest.approx(threshold, rel=1e-12)
    assert foam.delay(5.0, threshold) == 0.0
    assert foam.delay(0.4, threshold) == math.inf
    # The step is exact: a hundred small ones are one large one.
    state = 0.0
    for _ in range(100):
        state = foam.advance(state, force, 1e-4)
    assert state == pytest.approx(foam.advance(0.0, force, 1e-2), rel=1e-12)


def test_settling_after_switching() -> None:
    assert settled(1.0, 0.2, 0.0, 1e-5) == pytest.approx(0.2, rel=1e-15)
    assert settled(1.0, 0.2, 1e-5, 1e-5) == pytest.approx(1.0 - 0.8 / math.e)


def test_overlapping_contacts_join_and_edges_cut() -> None:
    sensor = Sensor(LINK)
    model = FieldContacts()
    same = model.admittance(sensor, [Contact(0.1, 3.0, 1e-3, 0.005), Contact(0.1, 3.0, 1e-3, 0.005)])
    whole = model.admittance(sensor, [Contact(0.1, 3.0, 2e-3, 0.005 * math.sqrt(2))])
    assert np.allclose(same, whole, rtol=1e-12)
    # Half of a contact off the sheet: half the conductance, as long as it is weak.
    weak = FieldModel(SectorSheet.of_frustum(LINK), 1000.0, 1000.0)
    half = model.coupling(weak, [Contact(0.1, 0.0, 1e-9, 0.005)])
    assert half.conductance[0] == pytest.approx(0.5e-9, rel=1e-5)
    # The centroid of the half disc that is left: 4 a / (3 pi) from the edge.
    sheet = weak.sheet
    across = half.y[0] * sheet.breadth * float(sheet.stretch(0.1))
    assert across == pytest.approx(4 * 0.005 / (3 * math.pi), rel=1e-3)
    several = [Contact(0.1, 0.0, 1e-3, 0.005), Contact(0.15, 3.0, 1e-3, 0.0), Contact(0.1001, 0.01, 1e-3, 0.003)]
    y = np.array(model.admittance(sensor, several))
    assert (y == y.T).all()
    with pytest.raises(FieldError, match="conductance of a contact must be 0 or more"):
        model.admittance(sensor, [Contact(0.1, 3.0, -1.0)])


def test_a_virtual_skin_runs_on_it_with_a_leak_under_the_touch() -> None:
    from coneskin.skin.virtual import Imperfections

    sensor = Sensor(LINK)
    middle = ScriptedTouch(0.0, 1.0, 0.5 * LINK.slant, 3.0, force=4.0, radius=0.008)
    skin = VirtualSkin(
        sensor, [middle], imperfections=Imperfections(leak=1e-8), model=FieldContacts(), rate_hz=200.0, duration=0.1
    )
    frames = [frame for _, frame in skin.frames()]
    assert len(frames) == 20


def test_the_model_agrees_with_ohm_without_contact() -> None:
    sensor = Sensor(LINK)
    sheets = FieldContacts().admittance(sensor, [])
    volts = measure(sensor, (sheets, sheets, sheets))
    assert volts.radial_current == pytest.approx(sensor.radial_amperes, rel=1e-9)
    assert volts.angular_current == pytest.approx(sensor.angular_amperes, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Foam(0.0), "relaxation_time must be positive"),
        (lambda: Foam(0.1, 1.0), r"delayed must be in \[0, 1\)"),
        (lambda: Layers(threshold_force=-1.0), "threshold_force must be 0 or more"),
        (lambda: FieldContacts(point_radius=0.0), "point_radius must be positive"),
    ],
)
def test_bad_values_are_refused(make, message) -> None:
    with pytest.raises(FieldError, match=message):
        make()
