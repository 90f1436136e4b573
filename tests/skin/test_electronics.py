"""Electronics chosen for a sheet: real parts, no geometry refused, what is given is kept."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.electronics import HEADROOM, Electronics, GivenElectronics, LeadOhms, match_electronics, shunt_ohms
from coneskin.skin.sensor import Sensor


def test_every_geometry_of_a_link_has_electronics():
    rng = random.Random(1)
    for _ in range(3000):
        radius = 10.0 ** rng.uniform(-2.0, 0.0)
        breadth_over_length = 10.0 ** rng.uniform(-1.4, 1.4)
        wrap = rng.uniform(1.0, 2.0 * math.pi)
        cone = Frustum(radius, radius * rng.uniform(0.5, 1.5), radius * wrap / breadth_over_length, wrap)
        sensor = Sensor(cone, upper_sheet_ohms=(ohms := 10.0 ** rng.uniform(1.0, 4.5)), lower_sheet_ohms=ohms)
        parts = sensor.electronics
        currents = sensor.radial_amperes, sensor.angular_amperes
        assert parts.current_full_scale >= HEADROOM * max(currents) * (1.0 - 1e-9)
        # the next shunt of the series, 2.4 % more, would not do; rounding of a value is 0.5 % of it. Below 1 ohm: E24
        step = 1.035 if shunt_ohms(parts) >= 1.0 else 1.16
        assert parts.current_full_scale < HEADROOM * max(currents) * step
        assert min(currents) / parts.current_full_scale * parts.full_count >= 16
        assert sensor.bounds.radial_high < parts.full_count
        if min(currents) / parts.current_full_scale * 4095 >= 100:
            assert parts.adc_bits == 12


def test_the_parts_can_be_bought():
    e96 = {round(10.0 ** (k / 96.0), 2) for k in range(96)}
    assert {1.0, 4.02, 9.31, 9.76} < e96  # of the published series
    e24 = {1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0, 3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5}
    for ohms in (12.0, 130.0, 954.0, 9300.0, 4e4):
        parts = match_electronics(ohms, 2.0 * ohms)
        shunt = shunt_ohms(parts)
        digits = shunt / 10.0 ** math.floor(math.log10(shunt) + 1e-12)
        assert min(abs(digits - value) for value in (e96 if shunt >= 1.0 else e24 | {8.2, 9.1})) < 1e-9
        assert f"{parts.pulldown_ohms:.0f}"[:2] in {"10", "20", "39", "82", "24", "36"}
        assert 2.0 * 2.0 * ohms <= parts.pulldown_ohms or parts.pulldown_ohms == 100e3
        assert parts.supply_volts in (2.5, 2.048, 1.25, 1.024, 0.512)


#: IEC 60063
E24 = "1.0 1.1 1.2 1.3 1.5 1.6 1.8 2.0 2.2 2.4 2.7 3.0 3.3 3.6 3.9 4.3 4.7 5.1 5.6 6.2 6.8 7.5 8.2 9.1"


def test_pulldowns_are_twice_the_larger_sheet_and_of_every_value_of_e24():
    for k in range(24):  # each is met from just below, from 10 kohm to 91 kohm
        wanted = 1e4 * float(E24.split()[k])
        assert match_electronics(100.0, 0.4999 * wanted).pulldown_ohms == pytest.approx(wanted)
    assert match_electronics(100.0, 100.0).pulldown_ohms == 10e3
    assert match_electronics(100.0, 1e6).pulldown_ohms == 100e3


@pytest.mark.parametrize(
    ("adc", "supply"), [(5.1, 3.0), (5.13, 4.096), (3.74, 2.5), (3.76, 3.0), (3.1, 2.048), (3.2, 2.5)]
)
def test_the_supply_is_the_largest_reference_within_four_fifths_of_the_converters_range(adc, supply):
    assert match_electronics(1e3, 1e3, GivenElectronics(adc_volts=adc)).supply_volts == supply


@pytest.mark.parametrize(("ohms", "supply"), [(48.1, 2.5), (47.9, 2.048), (23.1, 1.25), (18.4, 0.512), (18.6, 1.024)])
def test_no_sheet_draws_more_than_50_ma(ohms, supply):
    assert match_electronics(ohms, 1e3).supply_volts == supply  # beside leads of 2 ohm


def test_the_range_of_the_current_is_2_2_times_the_larger_one_at_a_gain_of_50():
    parts = match_electronics(998.0, 998.0)  # 2.5 mA
    assert 2.2 * 2.5e-3 < parts.current_full_scale < 1.03 * 2.2 * 2.5e-3
    assert parts.current_full_scale == pytest.approx(3.3 / (50.0 * 11.8))


def test_a_sheet_that_would_draw_too_much_gets_a_lower_supply():
    assert match_electronics(1000.0, 1000.0).supply_volts == 2.5
    assert match_electronics(30.0, 1000.0).supply_volts == 1.25  # 78 mA at 2.5 V, 64 mA at 2.048 V, 39 mA at 1.25 V
    assert match_electronics(0.5, 1000.0).supply_volts == 0.512  # the least: still not refused


def test_what_is_given_is_kept():
    given = GivenElectronics(3.0, 5.0, 10, 22e3, 5e6, LeadOhms(1.0, 2.0, 3.0, 4.0), 0.033)
    assert match_electronics(900.0, 1100.0, given) == Electronics(
        3.0, 5.0, 10, 22e3, 5e6, LeadOhms(1.0, 2.0, 3.0, 4.0), 0.033
    )
    assert match_electronics(900.0, 1100.0, GivenElectronics(supply_volts=1.0)).current_full_scale == pytest.approx(
        HEADROOM * 1.0 / 902.0, rel=0.03
    )


def test_electronics_that_are_given_to_a_sensor_are_its_own():
    assert Sensor(Frustum(0.054, 0.054, 0.434), electronics=Electronics()).electronics.current_full_scale == 0.02
    assert Sensor(Frustum(0.054, 0.054, 0.434)).electronics.current_full_scale < 0.008


def test_the_highest_count_is_the_range_of_the_converter():
    parts = Electronics()
    assert (parts.volts(4095), parts.volts(0)) == (3.3, 0.0)
    assert (parts.amperes(4095), parts.amperes(0)) == (0.02, 0.0)
