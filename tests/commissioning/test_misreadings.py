"""What a wrong skin reads, and that no choice of marks lets it pass."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.commissioning.acceptance.marks import _SLANT_PARTS, MIN_POWER, _azimuth_margin, plan_marks
from coneskin.commissioning.misreadings import (
    RIGHT,
    WRONG,
    Place,
    explain,
    misfit,
    misread,
    power,
    shifts,
    tolerance,
)
from coneskin.commissioning.touching import Mark
from coneskin.geometry.frustum import Frustum
from coneskin.scene.commissioning_record import MIN_MARKS
from coneskin.skin.electronics import Electronics, Polarity
from coneskin.skin.sensor import Sensor

FOREARM = Sensor(Frustum(0.0376, 0.0372, 0.24), name="forearm skin")
radii = st.floats(0.02, 0.15)
#: forearm of the demo; docs/look-up/scene.md's examples; a conical one; a patch [m, deg]
KNOWN = [(0.0376, 0.0373, 0.24, 360), (0.0605, 0.0605, 0.4, 300), (0.038, 0.046, 0.12, 360), (0.05, 0.09, 0.1, 120)]
sensors = st.builds(
    lambda r1, r2, h, wrap, radial, angular: Sensor(
        Frustum(r1, r2, h, wrap),
        polarity=Polarity(radial, angular),
        electronics=Electronics(adc_bits=16, current_full_scale=0.25),  # amperes matter to no place
    ),
    radii,
    radii,
    st.floats(0.06, 0.6),
    st.floats(math.radians(60.0), 2.0 * math.pi),
    st.sampled_from("AB"),
    st.sampled_from("CD"),
)


def offered(sensor: Sensor, first: float = 0.0) -> list[Mark]:
    """Places at every 15 deg from an angle on [deg], as far from the edges as marks are."""
    margin = _azimuth_margin(sensor)
    angles = [math.radians(first + 15.0 * k) for k in range(24)]
    return [
        Mark(u, phi, "")
        for u in (part * sensor.frustum.slant for part in _SLANT_PARTS)
        for phi in angles
        if margin <= phi <= sensor.frustum.wrap - margin
    ]


def worst(sensor: Sensor, marks: list[Place], read: list[Place], along: np.ndarray, around: np.ndarray) -> np.ndarray:
    """The largest error of all marks in tolerances, where the readings are moved along and about the link.

    Written anew, with numpy: shape (along, around).
    """
    allowed = tolerance(sensor)
    mark, seen = np.array(marks), np.array(read)
    off = np.abs(seen[:, 0] - mark[:, 0] + along[:, None]).max(axis=1) / allowed.u
    turn = np.exp(1j * (seen[:, 1] - mark[:, 1] + around[:, None]))  # on the unit circle, so that 359 deg is -1 deg
    return np.maximum.outer(off, np.abs(np.angle(turn)).max(axis=1) / allowed.phi)


@pytest.mark.promise("P13")
@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(sensors, st.floats(0.0, 15.0))
def test_every_misreading_misses_a_mark_by_twice_its_tolerance_wherever_the_sheet_is(s: Sensor, first: float) -> None:
    """Searched over a grid of offsets along and about the link, which is not how ``power`` finds its answer."""
    plan = plan_marks(s, offered(s, first))
    if plan is None:  # then it is refused, and never passes
        return
    assert len(plan) >= MIN_MARKS
    marks = [mark.place for mark in plan]
    along, around = s.frustum.slant * np.linspace(-1.0, 1.0, 81), np.radians(np.arange(0.0, 360.0, 2.0))
    for wrong in WRONG:
        found = worst(s, marks, [misread(s, wrong, mark) for mark in marks], along, around)
        assert found.min() >= MIN_POWER - 1e-9, wrong.cause


@pytest.mark.parametrize(("radius1", "radius2", "height", "wrap"), KNOWN)
def test_the_sensors_of_our_pages_have_marks(radius1: float, radius2: float, height: float, wrap: float) -> None:
    """Otherwise the test above could pass on sensors that are all refused."""
    sensor = Sensor(Frustum(radius1, radius2, height, math.radians(wrap)))
    plan = plan_marks(sensor, offered(sensor))
    assert plan is not None
    assert len(plan) == MIN_MARKS
    assert power(sensor, [shifts(sensor, mark.place) for mark in plan]) >= MIN_POWER


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(sensors, st.floats(-1.0, 1.0), st.floats(-math.pi, math.pi))
def test_an_offset_shows_in_every_mark(sensor: Sensor, along: float, around: float) -> None:
    marks = [mark.place for mark in plan_marks(sensor, offered(sensor)) or ()]
    if not marks:
        return
    allowed = tolerance(sensor)
    expected = max(abs(along) * sensor.frustum.slant / allowed.u, abs(around) / allowed.phi)
    moved = [Place(u + along * sensor.frustum.slant, phi + around) for u, phi in marks]
    assert misfit(sensor, RIGHT, marks, moved).largest == pytest.approx(expected, rel=1e-6, abs=1e-6)
    found = worst(sensor, marks, marks, np.array([along * sensor.frustum.slant]), np.array([around]))
    assert found[0, 0] == pytest.approx(expected, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("wrong", WRONG, ids=lambda item: item.cause[:40])
def test_each_misreading_is_named(wrong) -> None:
    marks = [mark.place for mark in plan_marks(FOREARM, offered(FOREARM)) or ()]
    read = [misread(FOREARM, wrong, mark) for mark in marks]
    assert explain(FOREARM, marks, read) == f"it reads as if {wrong.cause}"


def test_a_swap_of_the_wires_is_what_another_polarity_reads() -> None:
    """From the sensor's own law (eq. 19, 22), with the polarity of the other wiring."""
    swapped = Sensor(FOREARM.frustum, polarity=Polarity("A", "C"))
    place = Place(0.05, 1.0)
    assert misread(FOREARM, WRONG[0], place) == pytest.approx(FOREARM.place(*swapped.fractions(*place)), abs=1e-12)
    swapped = Sensor(FOREARM.frustum, polarity=Polarity("B", "D"))
    assert misread(FOREARM, WRONG[1], place) == pytest.approx(FOREARM.place(*swapped.fractions(*place)), abs=1e-12)
    assert misread(FOREARM, RIGHT, place) == pytest.approx(place, abs=1e-12)


def test_turned_and_shifted_sheets_are_named_with_their_amount() -> None:
    marks = [mark.place for mark in plan_marks(FOREARM, offered(FOREARM)) or ()]
    turned = [Place(u, (phi - math.radians(90.0)) % (2.0 * math.pi)) for u, phi in marks]
    assert explain(FOREARM, marks, turned) == "it reads as if the sheet were turned about the link by +90 deg (rpy_deg)"
    shifted = [Place(u - 0.03, phi) for u, phi in marks]
    assert explain(FOREARM, marks, shifted) == "it reads as if the sheet were shifted along the link by +30 mm (xyz_mm)"
    both = [Place(0.24 - u, math.radians(120.0) - phi) for u, phi in marks]
    assert "lay end for end on the link, and it were turned about the link by" in explain(FOREARM, marks, both)


def test_nonsense_is_not_explained() -> None:
    marks = [mark.place for mark in plan_marks(FOREARM, offered(FOREARM)) or ()]
    read = [Place(0.12, 0.3 + 1.7 * number) for number in range(len(marks))]
    assert explain(FOREARM, marks, read).endswith("was the right place touched?")


def test_marks_that_cannot_be_reached_are_replaced_as_long_as_the_rest_suffices() -> None:
    places = offered(FOREARM)
    first = plan_marks(FOREARM, places)
    assert first is not None
    again = plan_marks(FOREARM, places, first[:2], first[2:])
    assert again is not None
    assert again[:2] == first[:2]
    assert not set(again) & set(first[2:])
    assert power(FOREARM, [shifts(FOREARM, mark.place) for mark in again]) >= MIN_POWER
    one_row = [mark for mark in places if mark.u == places[0].u]
    assert plan_marks(FOREARM, one_row) is None, "a sheet that is mirrored along the link would pass"
    one_side = [mark for mark in places if abs(mark.phi - math.pi) < 0.3]
    assert plan_marks(FOREARM, one_side) is None
