"""The sensor's law: the paper's equations, their inverse, resistances, and what a sensor must not be."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.electronics import Electronics, Polarity, Thresholds
from coneskin.skin.sensor import Sensor

# The sector that fits the paper's simulations: r from 100 to 200 mm, theta0 = 90 deg, U0 = 2 V (section 3.1).
CONE = Frustum(0.04, 0.07, 0.15)
PAPER = Frustum(0.05, 0.025, 0.1 * math.sqrt(15) / 4)  # rho = r/4 for 90 deg on a full wrap, slant 100 mm
WIDE = Electronics(adc_bits=16, current_full_scale=0.2)  # suits any shape drawn here
COARSE = Electronics()  # 20 mA
TWO_VOLTS = Electronics(supply_volts=2.0)

cones = st.builds(
    Frustum,
    radius1=st.floats(0.02, 0.1),
    radius2=st.floats(0.02, 0.1),
    height=st.floats(0.05, 0.3),
    wrap=st.floats(2.5, 2 * math.pi),
)
polarities = st.builds(Polarity, st.sampled_from("AB"), st.sampled_from("CD"))


def test_published_potentials_at_150_mm_and_45_deg():
    # eq. 19: 2 ln(1.5)/ln(2) = 1.169925 V; eq. 24: 2 * 45/90 = 1 V
    sensor = Sensor(PAPER, electronics=TWO_VOLTS)
    u = 0.05  # r1 = 200 mm at end 1, so r = 150 mm is 50 mm from it
    phi = math.radians(45) * 2 * math.pi / (math.pi / 2)
    radial, angular = (2.0 * part for part in sensor.fractions(u, phi))
    assert radial == pytest.approx(1.1699250014423124, rel=1e-14)
    assert angular == pytest.approx(1.0, rel=1e-14)
    r, theta = PAPER.polar(*sensor.place(radial / 2.0, angular / 2.0))
    assert r == pytest.approx(0.150, rel=1e-14)
    assert math.degrees(theta) == pytest.approx(45.0, rel=1e-14)


def test_published_sensitivity():
    # eq. 25: U0/(r ln(r1/r2)) = 2/(0.15 ln 2) = 19.2360 V/m at r = 150 mm
    sensor = Sensor(PAPER, electronics=TWO_VOLTS)
    assert abs(sensor.radial_sensitivity(0.05)) == pytest.approx(2 / (0.15 * math.log(2)), rel=1e-13)


@given(cones, polarities, st.floats(0, 1), st.floats(0, 1))
def test_place_inverts_fractions(cone, polarity, along, around):
    sensor = Sensor(cone, polarity=polarity, electronics=WIDE)
    u, phi = cone.slant * along, cone.wrap * around
    back = sensor.place(*sensor.fractions(u, phi))
    # the potentials are fractions of 1, so a place near an end keeps an absolute, not a relative, precision
    assert back == (pytest.approx(u, abs=1e-14 * cone.slant), pytest.approx(phi, abs=1e-14 * cone.wrap))


@given(cones, polarities, st.floats(0.01, 0.99))
def test_the_sensitivity_is_a_derivative(cone, polarity, along):
    sensor = Sensor(cone, polarity=polarity, electronics=WIDE)
    u, h = cone.slant * along, 1e-7
    supply = sensor.electronics.supply_volts
    numeric = supply * (sensor.fractions(u + h, 1.0)[0] - sensor.fractions(u - h, 1.0)[0]) / (2 * h)
    assert sensor.radial_sensitivity(u) == pytest.approx(numeric, rel=1e-5)  # rounding: eps/h/slope ~ 1e-9 V / 5 V


@given(cones)
def test_swapped_polarity_is_the_complement(cone):
    plain, swapped = Sensor(cone, electronics=WIDE), Sensor(cone, electronics=WIDE, polarity=Polarity("A", "D"))
    for a, b in zip(plain.fractions(0.01, 0.3), swapped.fractions(0.01, 0.3), strict=True):
        assert a + b == pytest.approx(1.0, rel=1e-14)


def test_b_is_positive_at_end_1_and_c_at_the_far_edge():
    sensor = Sensor(Frustum(0.05, 0.04, 0.2, 3.0))
    assert sensor.fractions(0.0, 0.0) == (1.0, 0.0)
    assert sensor.fractions(sensor.frustum.slant, 3.0) == (0.0, 1.0)


def test_a_flipped_cone_mirrors_u():
    cone, flipped = Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.15)
    a = Sensor(cone).fractions(0.05, 1.0)[0]
    b = Sensor(flipped).fractions(cone.slant - 0.05, 1.0)[0]
    assert a + b == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("cone", [Frustum(0.03, 0.09, 0.0), Frustum(0.1, 1e-6, 0.2, 1.0), Frustum(0.054, 0.054, 0.434)])
def test_disc_near_apex_and_cylinder_are_ordinary(cone):
    sensor = Sensor(cone, electronics=WIDE)
    for along in (0.0, 1e-9, 0.3, 1.0):
        assert sensor.place(*sensor.fractions(cone.slant * along, 0.5)) == (
            pytest.approx(cone.slant * along, abs=1e-14 * cone.slant),
            pytest.approx(0.5, rel=1e-14),
        )


def test_readings_beyond_the_driven_range_give_the_end():
    sensor = Sensor(Frustum(0.05, 0.04, 0.2))
    assert sensor.place(1.01, -0.01) == (0.0, 0.0)
    assert sensor.place(-0.5, 2.0) == (pytest.approx(sensor.frustum.slant), sensor.frustum.wrap)


@given(cones)
def test_resistances_are_dual_and_equal_the_sum_of_rings(cone):
    sensor = Sensor(cone, electronics=WIDE, upper_sheet_ohms=900.0, lower_sheet_ohms=1100.0)
    # a sheet's radial resistance times the same sheet's angular resistance is its sheet resistance squared
    assert sensor.radial_ohms * sensor.angular_ohms == pytest.approx(900.0 * 1100.0, rel=1e-12)
    n = 2000  # midpoint rule: relative error (growth/n)**2/24 below 1e-6 for a growth up to 5
    rings = sum(cone.slant / n / (cone.wrap * cone.radius_at((k + 0.5) * cone.slant / n)) for k in range(n))
    assert sensor.radial_ohms == pytest.approx(900.0 * rings, rel=1e-6)
    assert sensor.radial_amperes == pytest.approx(2.5 / (sensor.radial_ohms + 2.0))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Sensor(Frustum(0.0, 0.04, 0.2)), r"radius1 must be above 0 m for a sensor: an apex"),
        (lambda: Sensor(PAPER, sensor_id=256), r"sensor_id must be a whole number from 0 to 255, got 256"),
        (lambda: Sensor(PAPER, device_id=-1), r"device_id must be .* 65535, got -1"),
        (lambda: Sensor(PAPER, upper_sheet_ohms=math.nan), r"upper_sheet_ohms must be finite and above 0"),
        (
            lambda: Sensor(PAPER, electronics=Electronics(), upper_sheet_ohms=1e6),
            r"current_full_scale must suit .* radial phase",
        ),
        (
            lambda: Sensor(PAPER, electronics=Electronics(), lower_sheet_ohms=10.0),
            r"current_full_scale must suit .* angular phase",
        ),
        (lambda: Electronics(supply_volts=0.0), r"supply_volts must be finite and above 0 V, got 0.0 V"),
        (lambda: Electronics(supply_volts=3.3), r"at most 95 % of adc_volts"),
        (lambda: Electronics(adc_bits=0), r"adc_bits must be a whole number from 8 to 16, got 0"),
        (lambda: Electronics(input_ohms=2e4), r"at least 10 times pulldown_ohms"),
        (lambda: Polarity("C"), r'radial must be "A" or "B", got \'C\''),
        (lambda: Thresholds(touch_level=0.04), r"release_level < touch_level"),
        (lambda: Thresholds(current_low=1.5), r"current_low must be above 0 and below 1"),
    ],
)
def test_a_sensor_that_cannot_be_is_refused(make, words):
    with pytest.raises(SensorError, match=words):
        make()
