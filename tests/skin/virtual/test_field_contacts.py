"""The exact field as contact model: it follows force, survives any script, and replaces what cannot be a disc."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.reading import Reading, read
from coneskin.skin.electronics import Electronics, LeadOhms
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder, frame_of, measure
from coneskin.skin.virtual.field_contacts import FieldContacts
from tests.support.field.contact_patch import ContactPatch, disc, solve_patch

from ..bench_top import UR10

LINK = Frustum(0.05, 0.08, 0.2, 6.0)
# r from 100 to 200 mm and theta0 = 90 deg, rolled through a full turn: rho = r/4, slant 100 mm
PAPER = Frustum(0.025, 0.05, 0.1 * math.sqrt(15) / 4)
FINE = Electronics(adc_bits=16, input_ohms=1e12, lead_ohms=LeadOhms.equal(1e-6))


def through_the_electronics(sensor: Sensor, contact: LayerContact) -> Reading:
    sheets = FieldContacts().admittances(sensor, [[contact]])[0]
    volts = measure(sensor, (sheets, sheets, sheets))
    parts = sensor.electronics
    counts = {n: parts.count_amperes(v) if "current" in n else parts.count_volts(v) for n, v in volts._asdict().items()}
    return read(sensor, frame_of((52, 0, 0, 0, 0, 0), counts))


@pytest.mark.parametrize("radius_mm", [1, 5, 10, 15, 20])
def test_area_error_in_the_middle_as_in_the_papers_figure_11c(radius_mm: int) -> None:
    # (150 mm, 45 deg), perfectly bonded equal sheets: the curvature alone is left, -a**2/(2 r), to the next order a**4
    error_mm = -(radius_mm**2) / (2 * 150)
    sensor = Sensor(PAPER, electronics=FINE)
    reading = through_the_electronics(sensor, LayerContact(0.05, math.pi, 1e9, radius_mm * 1e-3))
    assert reading.location_valid
    # half a count of 49648 over the slope at r = 150 mm: 0.1 m * 1.04 / 49648 / 2 = 1 um for each of two readings
    assert (reading.centre[0] - 0.05) * 1e3 == pytest.approx(error_mm, rel=1e-2, abs=0.003)
    assert math.degrees(reading.centre[1] - math.pi) / 4 == pytest.approx(0.0, abs=0.004)  # Fig. 12c: none, by symmetry


def test_scenes_keep_their_order_and_are_the_field_models() -> None:
    sensor = Sensor(LINK, lower_sheet_ohms=300.0)
    sheet = SectorSheet.of_frustum(LINK)
    exact = FieldModel(sheet, 1000.0, 300.0)
    one, two = LayerContact(0.05, 1.0, 1e-3, 0.004, 0.009), LayerContact(0.15, 4.0, 2e-3, 0.002, 0.009)
    scenes: list[list[LayerContact]] = [[one], [], [one, two], [one._replace(radius=0.007)], [two]]
    for contacts, y in zip(scenes, FieldContacts().admittances(sensor, scenes), strict=True):
        if not contacts:
            assert y == ResistorLadder().admittance(sensor, [])
            continue
        discs = [Disc(c.u, c.phi, c.radius, c.conductance / (math.pi * c.radius**2)) for c in contacts]
        wanted = exact.admittance(exact.discs(discs))[0]
        assert np.array(y) == pytest.approx(wanted, rel=1e-7, abs=1e-9 * wanted.max())  # tolerance of the model
        assert (np.array(y) == np.array(y).T).all()


def test_a_weak_contact_is_the_ladder_with_the_spreading_left_out() -> None:
    # 1 Mohm against a spreading resistance of some kohm: the couplings agree to that ratio
    sensor = Sensor(UR10)
    exact = FieldContacts().admittances(sensor, [[LayerContact(0.1, 1.0, 1e-6)]])[0]
    rough = ResistorLadder().admittance(sensor, [LayerContact(0.1, 1.0, 1e-6)])
    for j in (0, 1):
        for k in (2, 3):
            assert exact[j][k] == pytest.approx(rough[j][k], rel=5e-3)


@pytest.mark.parametrize(("u", "phi"), [(0.0, 2.0), (0.003, 2.0), (0.1, 0.0), (0.1, 0.05), (0.0, 0.0), (0.004, 0.06)])
def test_a_contact_across_an_edge_against_the_general_patch(u: float, phi: float) -> None:
    # The contact of 5 N, 6.6 mm in radius, its middle on an edge, near one, in a corner.
    sensor, radius, conductance = Sensor(LINK), 0.0066, 32.0
    siemens = conductance * math.pi * radius**2
    model = FieldModel(SectorSheet.of_frustum(LINK), 1000.0, 1000.0)
    patch = model.admittance(solve_patch(model, ContactPatch(u, phi, disc(radius), conductance), 32, 7))[0].tolist()
    mine = FieldContacts().admittances(sensor, [[LayerContact(u, phi, siemens, radius)]])[0]
    got, wanted = measure(sensor, [mine] * 3), measure(sensor, [patch] * 3)
    for place in (3, 4, 6, 7):  # what says the place: 0.15 % of 2.5 V, 0.3 mm of 200 (measured 0.2 mm)
        assert got[place] == pytest.approx(wanted[place], abs=0.0015 * 2.5)
    for place in (0, 1):  # what says the level: the smaller disc's current spreads with 150 ohm more of 7 kohm
        assert got[place] == pytest.approx(wanted[place], rel=0.04)
    # Pressed so weakly that spreading does not matter, it conducts as much as what is on the sheet.
    weak = FieldContacts().admittances(sensor, [[LayerContact(u, phi, 1e-6 * siemens, radius)]])[0]
    area = model.discs([Disc(0.1, 3.0, radius, 1e-6 * conductance)]).conductance[0]
    cut = solve_patch(model, ContactPatch(u, phi, disc(radius), 1e-6 * conductance), 32, 7).conductance[0]
    conducts = -sum(weak[upper][lower] for upper in (0, 1) for lower in (2, 3))
    assert conducts == pytest.approx(cut, rel=0.02)  # an arc is taken as straight, a corner as two edges
    assert conducts < 0.9 * area


def test_overlapping_contacts_conduct_as_one() -> None:
    sensor, model = Sensor(LINK), FieldContacts()
    one = LayerContact(0.1, 3.0, 1e-3, 0.005)
    same = model.admittances(sensor, [[one, one]])[0]
    joint = one._replace(conductance=2e-3, radius=0.005 * math.sqrt(2))
    assert np.allclose(same, model.admittances(sensor, [[joint]])[0])
    # 6 mm apart: smaller discs of the same conductance, whose spreading differs by ln 2 at most, at the same place
    apart = model.admittances(sensor, [[one, one._replace(u=0.106)]])[0]
    middle = model.admittances(sensor, [[one._replace(u=0.103, conductance=2e-3, radius=0.007)]])[0]
    got, wanted = measure(sensor, [apart] * 3), measure(sensor, [middle] * 3)
    assert got.touch_current == pytest.approx(wanted.touch_current, rel=0.03)
    assert got.radial_c + got.radial_d == pytest.approx(wanted.radial_c + wanted.radial_d, rel=2e-3)


def test_any_script_is_solved() -> None:
    sensor, rng = Sensor(LINK), np.random.default_rng(5)
    for _ in range(10):
        contacts = [
            LayerContact(rng.uniform(0, LINK.slant), rng.uniform(0, 6), 10 ** rng.uniform(-9, 0), reach * part, reach)
            for reach, part in zip(
                10 ** rng.uniform(-4, -0.5, rng.integers(1, 5)), rng.uniform(0.01, 1, 5), strict=False
            )
        ]
        y = np.array(FieldContacts().admittances(sensor, [contacts])[0])
        assert np.isfinite(y).all()
        assert (y == y.T).all()
        assert np.linalg.eigvalsh(y).min() > -1e-12 * y.max()  # passive


def test_the_model_agrees_with_ohm_without_contact() -> None:
    sensor = Sensor(LINK)
    sheets = FieldContacts().admittances(sensor, [[]])[0]
    volts = measure(sensor, (sheets, sheets, sheets))
    assert volts.radial_current == pytest.approx(sensor.radial_amperes, rel=1e-9)
    assert volts.angular_current == pytest.approx(sensor.angular_amperes, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: FieldContacts().admittances(Sensor(LINK), [[LayerContact(0.1, 3.0, -1.0)]])[0],
            "must be 0 or more and finite",
        ),
        (
            lambda: FieldContacts().admittances(Sensor(LINK), [[LayerContact(0.3, 3.0, 1.0)]])[0],
            "a contact must lie on sensor",
        ),
    ],
)
def test_bad_values_are_refused(make, message) -> None:
    with pytest.raises(FieldError, match=message):
        make()


@pytest.mark.long
def test_a_virtual_skin_starts_without_scipy():
    """Its import took longer than everything else between ``guard(scene)`` and an active guard."""
    code = "import sys, coneskin.skin.virtual.field_contacts; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0
