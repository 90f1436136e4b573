"""The exact field behind the electronics: the area error through frames and readings, and the ladder's limits."""

import math

import pytest

from coneskin.errors import FieldError, SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.circuit import Contact, measure
from coneskin.skin.disc_contacts import DiscContacts
from coneskin.skin.electronics import Electronics
from coneskin.skin.ladder import Ladder
from coneskin.skin.reading import Reading, read
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual import Imperfections, ScriptedTouch, VirtualSkin

from .bench_top import UR10, measured

# r from 100 to 200 mm and theta0 = 90 deg, rolled through a full turn: rho = r/4, slant 100 mm
PAPER = Frustum(0.025, 0.05, 0.1 * math.sqrt(15) / 4)
FINE = Electronics(adc_bits=16, input_ohms=1e12, lead_ohms=1e-6)


def through_the_electronics(sensor: Sensor, contact: Contact) -> Reading:
    sheets = DiscContacts().admittance(sensor, [contact])
    volts = measure(sensor, (sheets, sheets, sheets))
    parts = sensor.electronics
    counts = [parts.count_amperes(v) if "current" in n else parts.count_volts(v) for n, v in volts._asdict().items()]
    return read(sensor, measured(sensor)._replace(**dict(zip(volts._fields, counts, strict=True))))


@pytest.mark.parametrize("radius_mm", [1, 5, 10, 15, 20])
def test_area_error_in_the_middle_as_in_the_papers_figure_11c(radius_mm):
    # (150 mm, 45 deg), perfectly bonded equal sheets: the curvature alone is left, -a**2/(2 r), to the next order a**4
    error_mm = -(radius_mm**2) / (2 * 150)
    sensor = Sensor(PAPER, electronics=FINE)
    place = Contact(0.05, math.pi, 1e9, radius_mm * 1e-3)
    reading = through_the_electronics(sensor, place)
    assert reading.location_valid
    # half a count of 49648 over the slope at r = 150 mm: 0.1 m * 1.04 / 49648 / 2 = 1 um for each of two readings
    assert (reading.u - 0.05) * 1e3 == pytest.approx(error_mm, rel=1e-2, abs=0.003)
    assert math.degrees(reading.phi - math.pi) / 4 == pytest.approx(0.0, abs=0.004)  # Fig. 12c: none, by symmetry


def test_reciprocal_and_without_net_current():
    sensor = Sensor(UR10)
    y = DiscContacts().admittance(sensor, [Contact(0.1, 1.0, 1e-3), Contact(0.3, 4.0, 1e-2, 0.01)])
    for j in range(4):
        assert sum(y[j]) == pytest.approx(0.0, abs=1e-15)
        for k in range(4):
            assert y[j][k] == y[k][j]


def test_nothing_touching_is_the_ladder():
    sensor = Sensor(UR10)
    assert DiscContacts().admittance(sensor, [Contact(0.1, 1.0, 0.0)]) == Ladder().admittance(sensor, [])


def test_a_weak_contact_is_the_ladder_with_the_spreading_left_out():
    # 1 Mohm against a spreading resistance of some kohm: the couplings agree to that ratio
    sensor = Sensor(UR10)
    exact = DiscContacts().admittance(sensor, [Contact(0.1, 1.0, 1e-6)])
    rough = Ladder().admittance(sensor, [Contact(0.1, 1.0, 1e-6)])
    for j in (0, 1):
        for k in (2, 3):
            assert exact[j][k] == pytest.approx(rough[j][k], rel=5e-3)


def test_it_drives_the_virtual_skin():
    sensor = Sensor(UR10)
    touch = ScriptedTouch(0.01, 1.0, 0.1, 2.0, radius=0.008, rise=0.002)
    quiet = Imperfections(noise_counts=0.0)
    skin = VirtualSkin(sensor, [touch], model=DiscContacts(), imperfections=quiet, duration=0.5)
    last = read(sensor, [frame for _, frame in skin.frames()][-1])
    assert last.location_valid
    assert (last.u, last.phi) == (pytest.approx(0.1, abs=4e-4), pytest.approx(2.0, abs=5e-3))


def test_contacts_that_cannot_be():
    with pytest.raises(FieldError):
        DiscContacts().admittance(Sensor(UR10), [Contact(0.1, 1.0, 1e-3, 0.02), Contact(0.11, 1.0, 1e-3, 0.02)])
    with pytest.raises(SensorError, match="radius of a contact must be finite and above 0 m"):
        DiscContacts(radius=0.0)
