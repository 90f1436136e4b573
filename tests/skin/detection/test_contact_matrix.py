"""Contact matrix of a frame against the exact field model, whatever lies between the sheets and the converter."""

import math
from dataclasses import replace
from typing import Any

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameInversion, FrameNoise
from coneskin.skin.electronics import Electronics, LeadOhms, Polarity
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.fourport import Coupling
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, measure
from coneskin.skin.wire import Frame

from ..bench_top import measured

INPUTS = (*("touch_c", "touch_d", "touch_current", "radial_c", "radial_d", "radial_current"),) + (
    *("angular_a", "angular_b", "angular_current"),
)
SUPPLIES = ("touch_supply", "radial_supply", "angular_supply")
#: name in MatrixNoise -> the number or the two numbers whose covariance it is
NAMES = {"xx": "x", "xy": "x y", "yy": "y", "along_around": "along around"} | {
    f"{one}_{two}": f"{one} {two}" for one in "xy" for two in ("along", "around")
}
CONE = Frustum(0.03, 0.05, 0.15)
UPPER, LOWER = 800.0, 1500.0
POLARITIES = [Polarity(), Polarity("A", "C"), Polarity("B", "D"), Polarity("A", "D")]
TOUCHES = {
    "weak": [Disc(0.05, 2.0, 0.001, 10.0)],
    "large, near an edge": [Disc(0.02, 0.6, 0.012, 1e4)],
    "bonded": [Disc(0.1, 4.0, 0.008)],
    "two": [Disc(0.03, 1.0, 0.005, 1e4), Disc(0.12, 4.0, 0.007, 1e3)],
}


def sensor_of(polarity: Polarity, lead: float, bits: int = 16, load: float = 1e6) -> Sensor:
    parts = Electronics(adc_bits=bits, lead_ohms=LeadOhms.equal(lead), input_ohms=load)
    return Sensor(CONE, polarity=polarity, upper_sheet_ohms=UPPER, lower_sheet_ohms=LOWER, electronics=parts)


def model(upper: float = UPPER, lower: float = LOWER) -> FieldModel:
    return FieldModel(SectorSheet.of_frustum(CONE), upper, lower)


def exact_frame(sensor: Sensor, coupling: Coupling) -> Any:
    """A frame whose counts are not rounded."""
    parts, field = sensor.electronics, model(sensor.upper_sheet_ohms, sensor.lower_sheet_ohms)
    y = field.admittance(coupling)[0].tolist()
    volt, ampere = parts.full_count / parts.adc_volts, parts.full_count / parts.current_full_scale
    inputs = measure(sensor, (y, y, y))._asdict()
    counts = {k: v * (ampere if k.endswith("current") else volt) for k, v in inputs.items() if k in Frame._fields}
    return Frame(length=40, device=0, sensor=0, status=0, sequence=0, clock_us=0, **counts)


@pytest.mark.parametrize("polarity", POLARITIES)
@pytest.mark.parametrize("lead", [1e-3, 1.0, 20.0])
@pytest.mark.parametrize("touch", TOUCHES)
def test_the_six_numbers_are_those_of_the_field(touch, lead, polarity):
    sensor, sheet = sensor_of(polarity, lead), SectorSheet.of_frustum(CONE)
    true = model().discs(TOUCHES[touch])
    found = FrameInversion(sensor).invert(exact_frame(sensor, true)[6:18])
    assert found is not None
    upper, lower = sheet.breadth / (UPPER * sheet.length), sheet.length / (LOWER * sheet.breadth)
    assert found.conductance == pytest.approx(true.conductance[0], rel=1e-5)
    assert (found.x, found.y) == pytest.approx((true.x[0], true.y[0]), abs=1e-8)
    # one pass of the touch phase's leads leaves 1e-8 of the sheets' conductance
    assert found.along - upper == pytest.approx(true.xx[0], abs=3e-7 * upper)
    assert found.around - lower == pytest.approx(true.yy[0], abs=3e-7 * lower)
    assert found.cross == pytest.approx(true.xy[0], abs=3e-7 * upper)
    assert abs(found.reciprocity) < 1e-9 * upper
    assert abs(found.sum_rule) < 1e-7 * upper  # the virtual circuit rounds
    assert abs(found.split) < 1e-6


@pytest.mark.parametrize("lead", [1.0, 20.0])
def test_the_sheets_alone_are_what_the_untouched_currents_say(lead):
    sensor, sheet = sensor_of(Polarity(), lead), SectorSheet.of_frustum(CONE)
    parts = sensor.electronics
    scale = parts.full_count / parts.current_full_scale / (parts.supply_volts * parts.full_count / parts.adc_volts)
    found = FrameInversion(sensor).untouched(sensor.radial_amperes * scale, sensor.angular_amperes * scale)
    assert found[0] == pytest.approx(sheet.breadth / (UPPER * sheet.length), rel=1e-12)
    assert found[1] == pytest.approx(sheet.length / (LOWER * sheet.breadth), rel=1e-12)


def test_a_frame_without_contact_has_no_matrix():
    sensor = Sensor(CONE)
    assert FrameInversion(sensor).invert(measured(sensor)[6:18]) is None


def test_sheets_that_nothing_drives_have_no_matrix():
    frame = measured(Sensor(CONE), [LayerContact(0.08, 1.0, 1e-3)])
    dead = frame._replace(**dict.fromkeys(INPUTS[3:], 0))
    assert FrameInversion(Sensor(CONE)).invert(frame[6:18]) is not None
    assert FrameInversion(Sensor(CONE)).invert(dead[6:18]) is None


@pytest.mark.parametrize("dead", ["radial_c", "angular_current", "supply"])
def test_a_frame_that_cannot_be_is_not_inverted_or_leaves_a_remainder(dead):
    sensor = sensor_of(Polarity(), 1.0)
    frame = exact_frame(sensor, model().discs(TOUCHES["large, near an edge"]))
    good = FrameInversion(sensor).invert(frame[6:18])
    assert good is not None
    for name in ("touch_supply", "radial_supply", "angular_supply") if dead == "supply" else (dead,):
        frame = frame._replace(**{name: 0.5 * getattr(frame, name)})
    bad = FrameInversion(sensor).invert(frame[6:18])
    assert bad is not None
    remainder = abs(bad.reciprocity) / good.along + abs(bad.sum_rule) / good.along + abs(bad.split)
    assert remainder > 0.05


@pytest.mark.pure  # it steps by parts of a count
@pytest.mark.parametrize("polarity", POLARITIES)
@pytest.mark.parametrize(("touch", "sheets"), [*((one, (UPPER, LOWER)) for one in TOUCHES), ("two", (3000.0, 300.0))])
@pytest.mark.parametrize("length", [36, 40])
def test_the_noise_is_that_of_differences(touch, sheets, polarity, length):
    """Each count moved by one up and down, and the squares of what that does summed up."""
    sensor = replace(sensor_of(polarity, 3.0), upper_sheet_ohms=sheets[0], lower_sheet_ohms=sheets[1])
    frame = exact_frame(sensor, model(*sheets).discs(TOUCHES[touch]))
    inversion = FrameInversion(sensor)
    at = inversion.invert(frame[6:18])
    assert at is not None
    frame = frame._replace(length=length)
    slopes = []
    # the shortest frame measures one supply for all three phases
    for names in [(name,) for name in INPUTS] + ([SUPPLIES] if length == 36 else [(name,) for name in SUPPLIES]):
        ends = []
        for step in (0.5, -0.5):
            end = inversion.invert(frame._replace(**{name: getattr(frame, name) + step for name in names})[6:18])
            assert end is not None
            ends.append(end)
        slopes.append([high - low for high, low in zip(*ends, strict=True)])
    found = FrameNoise(sensor).of(at, frame, 1.0)
    numbers = ContactMatrix._fields
    for name, value in found._asdict().items():
        one, _, two = NAMES.get(name, name).partition(" ")
        i, j = numbers.index(one), numbers.index(two or one)
        truth = sum(slope[i] * slope[j] for slope in slopes)
        size = math.sqrt(sum(slope[i] ** 2 for slope in slopes) * sum(slope[j] ** 2 for slope in slopes))
        # 5 % of the deviations is what is left out: a twentieth of the noise of a place; and 2 % of what sheets share
        assert value == pytest.approx(truth, abs=(0.02 if "_a" in name else 0.1) * size), name
