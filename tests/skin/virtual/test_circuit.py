"""The sheets as resistors and the electronics around them, against hand calculation and laws."""

import random

import pytest

from coneskin.core.errors import SensorError
from coneskin.skin.electronics import Electronics, LeadOhms
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder, WiringFaults, measure, solve

from ..bench_top import CONE, UR10

SENSOR = Sensor(CONE)


def some_contacts(rng: random.Random, count: int) -> list[LayerContact]:
    return [
        LayerContact(rng.uniform(0, CONE.slant), rng.uniform(0, CONE.wrap), 10 ** rng.uniform(-6, 0))
        for _ in range(count)
    ]


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_the_four_port_is_reciprocal_and_carries_no_current_at_equal_potentials(count):
    y = ResistorLadder().admittance(SENSOR, some_contacts(random.Random(count), count))
    for j in range(4):
        assert sum(y[j]) == pytest.approx(0.0, abs=1e-15)  # conductances are up to 4e-3 S
        for k in range(4):
            assert y[j][k] == pytest.approx(y[k][j], rel=1e-9, abs=1e-18)


def test_no_contact_leaves_two_separate_resistors():
    y = ResistorLadder().admittance(SENSOR, [])
    assert y[0][1] == pytest.approx(-1 / SENSOR.radial_ohms)
    assert y[2][3] == pytest.approx(-1 / SENSOR.angular_ohms)
    assert y[0][2] == y[0][3] == y[1][2] == y[1][3] == 0.0


def test_each_driven_electrode_is_a_lead_from_the_supply_or_from_ground():
    leads = LeadOhms(1.0, 2.0, 3.0, 4.0)
    sensor = Sensor(CONE, electronics=Electronics(lead_ohms=leads))
    at = measure(sensor, [ResistorLadder().admittance(sensor, [])] * 3)
    assert (at.touch_a, at.touch_b) == pytest.approx((2.5, 2.5), abs=1e-9)
    radial, angular = sensor.radial_amperes, sensor.angular_amperes
    assert (at.radial_a, at.radial_b) == pytest.approx((leads.a * radial, 2.5 - leads.b * radial))
    assert (at.angular_c, at.angular_d) == pytest.approx((2.5 - leads.c * angular, leads.d * angular))


def test_contacts_at_one_place_or_on_an_edge_add_up():
    places = [(0.05, 1.0), (0.0, 0.0), (CONE.slant, CONE.wrap)]
    for u, phi in places:
        one = ResistorLadder().admittance(SENSOR, [LayerContact(u, phi, 2e-3)])
        two = ResistorLadder().admittance(SENSOR, [LayerContact(u, phi, 1e-3), LayerContact(u, phi, 1e-3)])
        for row, other in zip(one, two, strict=True):
            assert row == pytest.approx(other, rel=1e-5, abs=1e-8)  # nodes are at least 1e-6 of a sheet apart


def test_one_contact_by_hand():
    # B = 2.5 V, A = 0, the contact at a quarter of the upper sheet from B: the guides read the divider's potential,
    # loaded by two 10 Mohm resistors behind divider, contact and half the lower sheet each
    sensor = Sensor(UR10)
    u, phi, conductance = 0.25 * UR10.slant, 0.5 * UR10.wrap, 1e-3
    y = ResistorLadder().admittance(sensor, [LayerContact(u, phi, conductance)])
    volts = measure(sensor, (y, y, y))
    sheet, lower, lead = sensor.radial_ohms, sensor.angular_ohms, 1.0
    upper_b, upper_a = 0.25 * sheet + lead, 0.75 * sheet + lead
    open_volts = 2.5 * upper_a / (upper_a + upper_b)
    source = upper_a * upper_b / (upper_a + upper_b) + 1 / conductance
    guide = 0.5 * lower + lead + 10e6
    at_contact = open_volts * (guide / 2) / (source + guide / 2)
    assert volts.radial_c == pytest.approx(at_contact * 10e6 / guide, rel=1e-9)
    assert volts.radial_d == pytest.approx(volts.radial_c, rel=1e-9)
    # touch phase: both ends of the upper sheet at 2.5 V, C and D over 10 kohm each
    source = upper_a * upper_b / (upper_a + upper_b) + 1 / conductance
    guide = 0.5 * lower + lead + 10e3
    current = 2.5 / (source + guide / 2)
    assert volts.touch_current == pytest.approx(current, rel=1e-9)
    assert volts.touch_c == pytest.approx(current / 2 * 10e3, rel=1e-9)


def test_drive_current_of_the_untouched_sensor_is_the_normal_one():
    y = ResistorLadder().admittance(SENSOR, [])
    volts = measure(SENSOR, (y, y, y))
    assert volts.radial_current == pytest.approx(SENSOR.radial_amperes, rel=1e-9)
    assert volts.angular_current == pytest.approx(SENSOR.angular_amperes, rel=1e-9)
    assert volts.touch_current == pytest.approx(0.0, abs=1e-12)


def test_reciprocity_between_the_two_phases():
    # (Vc - Vd)/I1 = -(Va - Vb)/I2 for any contacts, if the guides are free and the leads are nothing
    ideal = Sensor(CONE, electronics=Electronics(input_ohms=1e12, lead_ohms=LeadOhms.equal(1e-6)))
    rng = random.Random(1)
    for _ in range(50):
        y = ResistorLadder().admittance(ideal, some_contacts(rng, 2))
        volts = measure(ideal, (y, y, y))
        lower = (volts.radial_c - volts.radial_d) / volts.radial_current
        upper = (volts.angular_a - volts.angular_b) / volts.angular_current
        assert lower == pytest.approx(-upper, rel=1e-5, abs=1e-5)


def test_solver_against_a_product():
    rng = random.Random(4)
    for n in (1, 3, 6):
        matrix = [[rng.uniform(-1, 1) + (2 * n if j == k else 0) for k in range(n)] for j in range(n)]
        x = [rng.uniform(-5, 5) for _ in range(n)]
        right = [sum(a * b for a, b in zip(row, x, strict=True)) for row in matrix]
        assert solve([row[:] for row in matrix], right) == pytest.approx(x, rel=1e-13)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: WiringFaults(opened=("E",)), "open wire must be one of A, B, C, D, got 'E'"),
        (lambda: WiringFaults(shorts=(("A", "earth"),)), "got 'A-earth'"),
        (
            lambda: ResistorLadder().admittance(SENSOR, [LayerContact(1.0, 0.0, 1e-3)]),
            r"contact must lie on .* u in \[0, 0.15",
        ),
        (
            lambda: ResistorLadder().admittance(SENSOR, [LayerContact(0.1, 0.0, -1.0)]),
            "conductance must not be negative",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(SensorError, match=words):
        make()
