"""What one frame says: level, place, and every fault that a frame alone can show."""

import math
import random
from dataclasses import replace

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.electronics import Electronics, LeadOhms, Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder, WiringFaults, measure
from coneskin.skin.wire import DrivenPotentials, Status

from ..bench_top import CONE, UR10, measured

SENSOR = Sensor(UR10)
PLACES = [
    LayerContact(u * UR10.slant, p * UR10.wrap, 1e-3) for u, p in [(0.5, 0.5), (0.03, 0.02), (0.97, 0.98), (0.03, 0.98)]
]


@pytest.mark.parametrize("polarity", [Polarity(), Polarity("A", "C"), Polarity("B", "D"), Polarity("A", "D")])
@pytest.mark.parametrize("cone", [UR10, CONE])
def test_a_place_is_read_to_half_a_count(cone, polarity):
    sensor = Sensor(cone, polarity=polarity)
    rng = random.Random(6)
    supply = sensor.electronics.count_volts(2.5)
    for _ in range(100):
        u, phi = rng.uniform(0, cone.slant), rng.uniform(0, cone.wrap)
        reading = read(sensor, measured(sensor, [LayerContact(u, phi, 10 ** rng.uniform(-4, -1))]))
        assert reading.fault is None
        assert reading.location_valid
        # guide, supply and current are each rounded to half a count: at most 1.5 counts, plus the small terms of the
        # load correction, through the sensitivity at the place
        slope = abs(sensor.radial_sensitivity(u)) / 2.5 * supply
        assert abs(reading.centre[0] - u) < 1.7 / slope
        assert abs(reading.centre[1] - phi) < 1.7 * cone.wrap / supply


def test_fine_converter_leaves_only_the_model():
    sensor = Sensor(CONE, electronics=Electronics(adc_bits=16))
    reading = read(sensor, measured(sensor, [LayerContact(0.05, 2.0, 3e-4)]))
    # 16 bits: half a count is 0.5/49648 of 153 mm = 1.6 um; the linear load correction leaves less
    assert reading.centre[0] == pytest.approx(0.05, abs=5e-6)
    assert reading.centre[1] == pytest.approx(2.0, abs=2e-4)


def test_leads_are_taken_off():
    # 50 ohm in every lead would be 3 % of the scale, 13 mm, if nobody corrected it
    sensor = Sensor(UR10, electronics=Electronics(adc_bits=16, lead_ohms=LeadOhms.equal(50.0)))
    reading = read(sensor, measured(sensor, [LayerContact(0.02, 0.1, 1e-3)]))
    assert reading.centre[0] == pytest.approx(0.02, abs=2e-5)
    assert reading.centre[1] == pytest.approx(0.1, abs=2e-4)


def test_level_rises_with_conductance_and_hardly_depends_on_the_place():
    last = [0.0] * len(PLACES)
    for conductance in (1e-6, 1e-5, 3e-5, 1e-4, 1e-3, 1e-2, 1.0):
        levels = [read(SENSOR, measured(SENSOR, [c._replace(conductance=conductance)])).level for c in PLACES]
        assert all(now > before for now, before in zip(levels, last, strict=True))
        last = levels
        assert max(levels) - min(levels) < 0.06  # the sheets' own resistance against the pull-downs: 0.5 of 5 kohm
    assert 0.9 < min(last) <= max(last) < 1.0


def test_untouched_is_valid_and_level_zero():
    reading = read(SENSOR, measured(SENSOR))
    assert reading == (SENSOR, 0, 0, 0.0, None, False, None)


def test_a_light_touch_is_certain_before_its_place_is():
    reading = read(SENSOR, measured(SENSOR, [LayerContact(0.2, 1.0, 3e-5)]))
    assert SENSOR.thresholds.touch_level < reading.level < SENSOR.thresholds.location_level
    assert reading.fault is None
    assert not reading.location_valid
    assert reading.centre[0] == pytest.approx(0.2, abs=1e-3)


def test_two_touches_are_a_touch_with_an_ambiguous_place_not_a_fault():
    # at opposite corners the lower sheet carries a current, so C and D differ
    reading = read(SENSOR, measured(SENSOR, [LayerContact(0.05, 1.0, 1e-2), LayerContact(0.4, 5.0, 1e-2)]))
    assert reading.level > 0.9
    assert reading.fault is None
    assert not reading.location_valid


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [((0.2, 1.0), (0.2, 5.0), (0.2, 3.0)), ((0.1, 2.0), (0.3, 2.0), (0.2, 2.0))],
    ids=["equal u", "equal phi"],
)
def test_two_contacts_at_equal_u_or_phi_read_as_one_valid_place_between_them(first, second, expected):
    """The limit that docs/look-up/wire-format.md states: a valid place does not prove a single contact."""
    # firm, but too weak to load the sheets, so the place is the plain mean
    reading = read(SENSOR, measured(SENSOR, [LayerContact(*first, 3e-5), LayerContact(*second, 3e-5)]))
    assert reading.location_valid
    assert reading.centre[0] == pytest.approx(expected[0], abs=0.005)
    assert reading.centre[1] == pytest.approx(expected[1], abs=0.05)


@pytest.mark.parametrize("polarity", [Polarity(), Polarity("A", "C"), Polarity("B", "D"), Polarity("A", "D")])
def test_the_potential_at_the_contact_is_between_the_guides(polarity):
    # physics: V1 = Vd + (Vc - Vd) phi/wrap, V2 = Vb + (Va - Vb) x; here solved for the guides of a known place
    sensor = Sensor(
        CONE, polarity=polarity, electronics=Electronics(adc_bits=16, input_ohms=1e12, lead_ohms=LeadOhms.equal(1e-6))
    )
    u, phi, spread = 0.04, 1.2, 5000
    good = measured(sensor, [LayerContact(u, phi, 1e-2)])
    x = sensor._from_end1.fraction(u)
    g = phi / CONE.wrap
    sign = 1 if sensor.b_positive == sensor.c_positive else -1
    other = -sign * round(spread * good.angular_current / good.radial_current)  # by reciprocity
    frame = good._replace(
        radial_c=round(good.radial_c + spread * (1 - g)),
        radial_d=round(good.radial_d - spread * g),
        angular_a=round(good.angular_a + other * (1 - x)),
        angular_b=round(good.angular_b - other * x),
    )
    reading = read(sensor, frame)
    assert reading.fault is None
    assert reading.location_valid
    # what two passes leave is of second order in the spread (0.1 of the supply); uncorrected, u is 4 mm off
    assert reading.centre[0] == pytest.approx(u, abs=1e-4)
    assert reading.centre[1] == pytest.approx(phi, abs=4e-3)


@pytest.mark.parametrize("wide", ["radial", "angular"])
def test_either_pair_of_guides_can_make_the_place_ambiguous(wide):
    good = measured(SENSOR, PLACES[:1])
    supply = good.touch_supply
    ratio = good.angular_current / good.radial_current  # 1.6: a spread in the lower sheet is larger in the upper
    upper = 0.17 * supply if wide == "angular" else -0.2 * supply * ratio
    lower = -upper / ratio
    frame = good._replace(
        radial_c=round(good.radial_c + lower / 2),
        radial_d=round(good.radial_d - lower / 2),
        angular_a=round(good.angular_a + upper / 2),
        angular_b=round(good.angular_b - upper / 2),
    )
    reading = read(SENSOR, frame)
    assert reading.fault is None
    assert not reading.location_valid


BROKEN = {
    WiringFaults(opened=("A",)): (Fault.OPEN_UPPER, Fault.OPEN_A),
    WiringFaults(opened=("B",)): (Fault.OPEN_UPPER, Fault.OPEN_B),
    WiringFaults(opened=("C",)): (Fault.OPEN_LOWER, Fault.OPEN_C),
    WiringFaults(opened=("D",)): (Fault.OPEN_LOWER, Fault.OPEN_D),
    WiringFaults(opened=("A", "B", "C", "D")): (Fault.OPEN_UPPER, Fault.OPEN_UPPER),
    WiringFaults(shorts=(("A", "B"),)): (Fault.SHORT_UPPER, Fault.SHORT_UPPER),
    WiringFaults(shorts=(("C", "D"),)): (Fault.SHORT_LOWER, Fault.SHORT_LOWER),
    WiringFaults(shorts=(("B", "ground"),)): (Fault.SHORT_UPPER, Fault.SHORT_UPPER),
    WiringFaults(shorts=(("C", "ground"),)): (Fault.SHORT_LOWER, Fault.SHORT_LOWER),
    WiringFaults(shorts=(("A", "ground"),)): (Fault.LEAK, Fault.LEAK),
    WiringFaults(shorts=(("D", "rail"),)): (Fault.SHORT_LOWER, Fault.SHORT_LOWER),
    WiringFaults(shorts=(("A", "rail"),)): (Fault.SHORT_UPPER, Fault.SHORT_UPPER),
    WiringFaults(shorts=(("B", "rail"),)): (Fault.GUIDE_DRIVEN, Fault.GUIDES_DISAGREE),
}


@pytest.mark.parametrize("polarity", [Polarity(), Polarity("A", "D")])
@pytest.mark.parametrize("wiring", BROKEN, ids=lambda w: f"{'open ' * bool(w.opened)}{w.opened or w.shorts}")
def test_what_is_broken_is_named_touched_or_not(wiring, polarity):
    if polarity.radial == "A":  # the same break on the mirrored sensor
        swap = str.maketrans("ABCD", "BADC")
        wiring_here = WiringFaults(
            tuple(name.translate(swap) for name in wiring.opened),
            tuple((a.translate(swap), b.translate(swap) if len(b) == 1 else b) for a, b in wiring.shorts),
        )
    else:
        wiring_here = wiring
    sensor = Sensor(UR10, polarity=polarity)
    untouched, touched = BROKEN[wiring]
    found = read(sensor, measured(sensor, [], wiring_here)).fault
    assert found is untouched
    found = read(sensor, measured(sensor, PLACES[:1], wiring_here)).fault
    names = (
        {touched.name}
        if polarity.radial == "B"
        else {touched.name, touched.name.translate(str.maketrans("ABCD", "BADC"))}
    )
    assert found is not None
    assert found.name in names


@pytest.mark.promise("P10")
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("rail", ["ground", "supply", "rail"])
@pytest.mark.parametrize("electrode", "ABCD")
def test_no_short_hides_a_touch(electrode, rail, place):
    # D at ground cannot be seen before the touch (docs/look-up/wire-format.md); then the touch is seen, or is a fault
    reading = read(SENSOR, measured(SENSOR, [place], WiringFaults(shorts=((electrode, rail),))))
    assert reading.fault is not None or reading.level >= SENSOR.thresholds.touch_level


@pytest.mark.parametrize("pair", [("A", "C"), ("A", "D"), ("B", "C"), ("B", "D")])
def test_layers_shorted_at_an_edge_are_a_touch(pair):
    reading = read(SENSOR, measured(SENSOR, [], WiringFaults(shorts=(pair,))))
    assert reading.level > 0.9


@pytest.mark.parametrize(
    ("contacts", "changes", "fault"),
    [
        ([], {"touch_supply": 0}, Fault.SUPPLY),
        ([], {"radial_supply": 4095}, Fault.SUPPLY),
        ([], {"angular_supply": 2500}, Fault.SUPPLY),
        ([], {"status": Status.ADC}, Fault.DEVICE),
        ([], {"status": Status.RESERVED}, Fault.DEVICE),
        ([], {"radial_supply": 0, "status": Status.SUPPLY}, Fault.DEVICE),
        ([], {"radial_current": 0}, Fault.OPEN_UPPER),
        ([], {"angular_current": 4095}, Fault.SHORT_LOWER),
        ([], {"radial_c": 4095}, Fault.SATURATED),
        ([], {"radial_c": 65535}, Fault.SATURATED),
        (PLACES[:1], {"touch_c": 0}, Fault.LEAK),
        (PLACES[:1], {"touch_c": 0, "touch_d": 0}, Fault.LEAK),
        (PLACES[:1], {"touch_current": 0}, Fault.LEAK),
        ([], {"touch_c": 1500}, Fault.LEAK),
        ([], {"touch_c": 600, "touch_d": 0, "touch_current": 10}, Fault.GUIDES_DISAGREE),
        ([], {"radial_c": 3000, "radial_d": 3000}, Fault.GUIDE_DRIVEN),
        (PLACES[:1], {"angular_a": 3103, "angular_b": 3103, "radial_c": 3500, "radial_d": 3500}, Fault.GUIDE_DRIVEN),
        (PLACES[:1], {"angular_a": 0}, Fault.GUIDES_DISAGREE),
        (PLACES[:1], {"radial_d": 3000}, Fault.GUIDES_DISAGREE),
        (PLACES[:1], {"radial_c": 3230, "radial_d": 3230}, Fault.OUT_OF_RANGE),
    ],
)
def test_a_frame_that_cannot_be_is_a_fault(contacts, changes, fault):
    good = measured(SENSOR, contacts)
    assert read(SENSOR, good).fault is None
    reading = read(SENSOR, good._replace(**changes))
    assert reading.fault is fault
    assert not reading.location_valid


@pytest.mark.parametrize("status", [Status.RESTARTED, Status.TOUCH])
def test_bits_that_are_only_news_are_no_fault(status):
    assert read(SENSOR, measured(SENSOR, status=status)).fault is None


def test_any_counts_give_finite_values_and_never_raise():
    rng = random.Random(9)
    good = measured(SENSOR, PLACES[:1])
    names = good._fields[6:-1]
    for _ in range(5000):
        changes = {rng.choice(names): rng.choice([0, 1, 4094, 4095, 65535, rng.randrange(65536)]) for _ in range(4)}
        reading = read(SENSOR, good._replace(**changes))
        assert math.isfinite(reading.level)
        assert 0.0 <= reading.centre[0] <= UR10.slant * (1 + 1e-12)
        assert 0.0 <= reading.centre[1] <= UR10.wrap * (1 + 1e-12)


def test_every_fault_has_a_sentence_of_its_own():
    sentences = [fault.value for fault in Fault]
    assert len(set(sentences)) == len(sentences)
    assert all(len(sentence) > 20 and not sentence.endswith(".") for sentence in sentences)


@pytest.mark.parametrize(("electrode", "sheet"), [("A", "AB"), ("B", "AB"), ("C", "CD"), ("D", "CD")])
@pytest.mark.long
def test_a_wire_that_is_fed_from_elsewhere_is_named_by_its_own_sheet(electrode, sheet):
    """Through a firm contact it takes the current of both phases; the sheet that has less of its own is the one."""
    names = {f"OPEN_{each}" for each in (*sheet, {"AB": "UPPER", "CD": "LOWER"}[sheet])}
    rng, others = random.Random(1), 0
    for _ in range(400):
        sensor = rng.choice([SENSOR, Sensor(CONE), Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1))])
        u, phi = rng.random() * sensor.frustum.slant, rng.random() * sensor.frustum.wrap
        contact = LayerContact(u, phi, 10.0 ** rng.uniform(-5.0, -1.0))
        fault = read(sensor, measured(sensor, [contact], WiringFaults(shorts=((electrode, "supply"),)))).fault
        assert fault is not None
        others += fault.name not in names
    assert others <= 1  # where both currents are next to nothing; 11 and 14 of C and D before


@pytest.mark.parametrize("polarity", [Polarity(), Polarity("A", "D")])
def test_a_lead_of_too_much_resistance_shows_in_the_driven_potentials(polarity):
    """100 ohm that nobody told, in the wire of one electrode: 8 % of the supply, and the place 20 mm off."""
    sensor = Sensor(UR10, polarity=polarity)
    for electrode in (None, "a", "b", "c", "d"):
        ohms = {name: 100.0 if name == electrode else 1.0 for name in "abcd"}
        worn = replace(sensor, electronics=replace(sensor.electronics, lead_ohms=LeadOhms(**ohms)))
        counts = measured(worn, PLACES[:1])
        sheets = ResistorLadder().admittance(worn, PLACES[:1])
        own = measure(worn, (sheets, sheets, sheets))[12:]
        frame = counts._replace(length=52, driven=DrivenPotentials._make(map(sensor.electronics.count_volts, own)))
        assert read(sensor, frame).fault is (Fault.LEAD if electrode else None)
        assert read(worn, frame).fault is None  # it was told


def test_a_supply_that_is_read_too_high_shows_in_the_driven_potentials():
    sheets = ResistorLadder().admittance(SENSOR, PLACES[:1])
    own = DrivenPotentials._make(map(SENSOR.electronics.count_volts, measure(SENSOR, (sheets, sheets, sheets))[12:]))
    good = measured(SENSOR, PLACES[:1])._replace(length=52, driven=own)
    assert read(SENSOR, good).fault is None
    for name in ("touch_supply", "radial_supply", "angular_supply"):
        off = good._replace(**{name: round(1.06 * getattr(good, name))})
        assert read(SENSOR, off).fault is Fault.LEAD
