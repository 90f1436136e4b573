"""The place map: its inverse, its derivatives, its limits, and what leads do to a reading."""

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.calibration import MAP_LIMITS, PlaceMap
from coneskin.skin.detection.detector import Detector
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.wire import Frame

from .bench_top import CONE, UR10, measured

CYLINDER = Frustum(0.0373, 0.0373, 0.24)
NEARLY = Frustum(0.0373, 0.0373 * (1.0 + 1e-13), 0.24)
SHEETS = [CYLINDER, NEARLY, CONE, UR10, Frustum(0.02, 0.2, 0.1, 1.3)]
numbers = st.tuples(*(st.floats(-most, most) for most in MAP_LIMITS))
fractions = st.floats(0.15, 0.85)  # a map of the largest numbers moves no place from there beyond a rim


@given(st.sampled_from(SHEETS), numbers, numbers, fractions, fractions)
def test_the_inverse_undoes_it(cone, along, around, part_u, part_phi):
    correction = PlaceMap(cone, along, around)
    u, phi = part_u * cone.slant, part_phi * cone.wrap
    back = correction.invert(*correction.apply(u, phi))
    assert back == pytest.approx((u, phi), rel=1e-9)


@given(st.sampled_from(SHEETS), numbers, numbers, fractions, fractions)
def test_the_derivatives_are_those_of_differences(cone, along, around, part_u, part_phi):
    correction = PlaceMap(cone, along, around)
    u, phi = part_u * cone.slant, part_phi * cone.wrap
    step_u, step_phi = 1e-5 * cone.slant, 1e-5 * cone.wrap
    (uu, up), (pu, pp) = correction.jacobian(u, phi)
    more, less = correction.apply(u + step_u, phi), correction.apply(u - step_u, phi)
    scale_u, scale_phi = cone.slant, cone.wrap
    assert (more[0] - less[0]) / (2.0 * step_u) == pytest.approx(uu, abs=1e-6)
    assert (more[1] - less[1]) / (2.0 * step_u) == pytest.approx(pu, abs=1e-6 * scale_phi / scale_u)
    more, less = correction.apply(u, phi + step_phi), correction.apply(u, phi - step_phi)
    assert (more[0] - less[0]) / (2.0 * step_phi) == pytest.approx(up, abs=1e-6 * scale_u / scale_phi)
    assert (more[1] - less[1]) / (2.0 * step_phi) == pytest.approx(pp, abs=1e-6)


@pytest.mark.parametrize("cone", SHEETS)
def test_of_zeros_it_changes_nothing(cone):
    rng = random.Random(1)
    for _ in range(100):
        place = rng.uniform(0.0, cone.slant), rng.uniform(0.0, cone.wrap)
        assert PlaceMap(cone).apply(*place) == place


@given(st.sampled_from(SHEETS), numbers, numbers, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_place_leaves_the_sheet_and_the_limits_keep_it_one_to_one(cone, along, around, part_u, part_phi):
    correction = PlaceMap(cone, along, around)
    u, phi = part_u * cone.slant, part_phi * cone.wrap
    seen = correction.apply(u, phi)
    assert 0.0 <= seen[0] <= cone.slant
    assert 0.0 <= seen[1] <= cone.wrap
    (uu, up), (pu, pp) = correction.jacobian(u, phi)
    assert uu > 0.0
    assert pp > 0.0
    assert uu * pp - up * pu > 0.0


def test_a_full_turn_is_closed_and_any_other_wrap_ends():
    shifted = (0.01, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert PlaceMap(CYLINDER, around=shifted).apply(0.1, 0.999 * math.tau)[1] == pytest.approx(0.009 * math.tau)
    open_sheet = replace(CYLINDER, wrap=6.0)
    assert PlaceMap(open_sheet, around=shifted).apply(0.1, 0.999 * 6.0)[1] == 6.0


def test_near_a_cylinder_it_is_that_of_the_cylinder():
    along, around = (0.01, -0.02, 0.02, 0.03, 0.04, -0.05), (-0.01, 0.02, 0.01, -0.03, 0.04, 0.05)
    for place in ((0.03, 0.5), (0.2, 5.0)):
        of_cylinder = PlaceMap(CYLINDER, along, around).apply(*place)
        assert PlaceMap(NEARLY, along, around).apply(*place) == pytest.approx(of_cylinder, rel=1e-12)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"along": (0.0, 0.051, 0.0, 0.0, 0.0, 0.0)}, "place_map.along must be 6 numbers of at most 0.05, 0.05, 0.05"),
        ({"around": (0.0, 0.0, math.nan, 0.0, 0.0, 0.0)}, "place_map.around must be 6 numbers"),
        ({"around": (0.0,) * 5}, "place_map.around must be 6 numbers"),
    ],
)
def test_what_is_no_correction_is_refused(keys, words):
    with pytest.raises(SensorError, match=words):
        PlaceMap(CYLINDER, **keys)


def test_a_sheet_with_an_apex_or_of_another_sensor_is_refused():
    with pytest.raises(SensorError, match="no apex"):
        PlaceMap(Frustum(0.0, 0.1, 0.1))
    with pytest.raises(SensorError, match="place_map must be one of"):
        Sensor(CONE, place_map=PlaceMap(CYLINDER))


@pytest.mark.parametrize("cone", [CYLINDER, CONE])
def test_excess_leads_are_taken_off_by_offset_and_gain_alone(cone):
    """Leads of b ohm more at the end that counts from, and of a at the other, make of x: (x R + b) / (R + a + b)."""
    plain = Sensor(cone)
    ohms, at_b, at_a = plain.radial_ohms, 11.0, 4.0
    contact = LayerContact(0.3 * cone.slant, 0.6 * cone.wrap, 1e-3)
    frame: Frame = measured(plain, [contact])
    far = 1.0 - plain.fractions(contact.u, contact.phi)[0]  # B is positive: the fraction from end 1 is the rest
    wrong_u, _ = plain.place(1.0 - (far * ohms + at_b) / (ohms + at_a + at_b), 0.5)
    gain = (ohms + at_a + at_b) / ohms
    along = (0.5 * (gain - 1.0) - at_b / ohms, gain - 1.0, 0.0, 0.0, 0.0, 0.0)
    u, _ = PlaceMap(cone, along).apply(wrong_u, 1.0)
    assert abs(wrong_u - contact.u) > 1e-3
    assert u == pytest.approx(contact.u, rel=1e-12)
    raw, seen = detected(plain, frame), detected(replace(plain, place_map=PlaceMap(cone, along)), frame)
    assert seen == pytest.approx(PlaceMap(cone, along).apply(*raw), rel=1e-12)
    assert seen[0] != raw[0]


def detected(sensor: Sensor, touched: Frame) -> tuple[float, float]:
    """Return the place that a detector reads after some untouched frames and some of a touch."""
    detector = Detector(sensor)
    for number, frame in enumerate([measured(sensor)] * 100 + [touched] * 5):
        detector.feed(frame._replace(sequence=number, clock_us=1000 * number), 1e-3 * number)
    reading = detector.reading_now
    assert reading is not None
    return reading.u, reading.phi
