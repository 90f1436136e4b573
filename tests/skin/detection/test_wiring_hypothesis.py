"""What a hypothesis predicts is what the circuit of the virtual skin does, which shares no code with it."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.fault_diagnosis import _list_hypotheses, _PointContact
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder, WiringFaults, measure

FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))


def wiring_of(words: str) -> WiringFaults:
    first = words.split()[0]
    if words == "nothing":
        return WiringFaults()
    if words.endswith("open"):
        return WiringFaults((first,))
    if words.startswith("switch"):
        return WiringFaults(shorts=((words.split()[2], "rail"),))
    return WiringFaults(shorts=((first, words.split()[-1]),))


@pytest.mark.parametrize("polarity", [Polarity(), Polarity("A", "D")])
def test_every_reading_of_every_hypothesis_is_the_circuit_s(polarity):
    sensor = Sensor(FOREARM, polarity=polarity)
    rng = random.Random(5)
    upper, lower = 1.0 / sensor.radial_ohms, 1.0 / sensor.angular_ohms
    hypotheses = [each for each in _list_hypotheses(sensor) if "dead" not in each.words]
    assert len(hypotheses) == 23
    for hypothesis in hypotheses:
        x, y, siemens = rng.uniform(0.05, 0.95), rng.uniform(0.05, 0.95), 10.0 ** rng.uniform(-4.0, -2.0)
        contact = LayerContact(x * FOREARM.slant, y * FOREARM.wrap, siemens)
        sheets = ResistorLadder().admittance(sensor, [contact])
        inputs = measure(sensor, (sheets, sheets, sheets), wiring_of(hypothesis.words))
        supply = sensor.electronics.supply_volts
        expected = [value / supply for value in (*inputs[:9], *inputs[12:])]
        found = hypothesis.predict(_PointContact(siemens, x, y), upper, lower, [math.inf] * 15)
        # the circuit joins by 0.1 ohm, which a lead of 1 ohm turns into 5 % of the supply; a prediction joins by none
        slack = 0.1 if "joined with" in hypothesis.words else 1e-6
        for k, (one, other) in enumerate(zip(found, expected, strict=True)):
            if k not in (2, 5, 8):
                assert one == pytest.approx(other, abs=slack), (hypothesis.words, k)
            else:
                assert one == pytest.approx(other, rel=slack, abs=1e-6), (hypothesis.words, k)


def test_a_dead_input_reads_nothing_and_what_exceeds_the_converter_reads_its_end():
    sensor = Sensor(FOREARM)
    by_words = {each.words: each for each in _list_hypotheses(sensor)}
    highest = [1.2] * 9
    contact, sheets = _PointContact(1e-3, 0.5, 0.5), (1e-3, 1e-3)
    dead = by_words["input of C dead"].predict(contact, *sheets, highest)
    assert (dead[0], dead[3]) == (0.0, 0.0)
    assert dead[1] > 0.1
    shorted = by_words["A joined with B"].predict(contact, *sheets, [1.2, 1.2, 0.01] * 3)
    assert shorted[5] == 0.01


#: untouched, the readings of each of these are the same: names that docs/look-up/wire-format.md has for them say both
ALIKE = [
    ("A open", "B open"),
    ("C open", "D open"),
    ("C joined with D", "C joined to ground"),
    ("nothing", "D joined to ground", "input of A dead", "input of B dead", "input of C dead", "input of D dead"),
    ("nothing", "touch phase dead"),
]


@pytest.mark.parametrize("words", ALIKE, ids=lambda words: words[0])
def test_what_cannot_be_told_apart_without_a_touch_is_in_the_circuit(words):
    sensor = Sensor(FOREARM)
    by_words = {each.words: each for each in _list_hypotheses(sensor)}
    parts = sensor.electronics
    full = parts.adc_volts / parts.supply_volts
    highest = [full, full, parts.current_full_scale / parts.supply_volts] * 3
    count = full / parts.full_count
    sheets = 1.0 / sensor.radial_ohms, 1.0 / sensor.angular_ohms
    for where, touch in (("bare", 0.0), ("touched", 1e-3)):
        first, *others = (by_words[each].predict(_PointContact(touch, 0.3, 0.6), *sheets, highest) for each in words)
        for other in others:
            apart = max(abs(a - b) for k, (a, b) in enumerate(zip(first, other, strict=True)) if k not in (2, 5, 8))
            assert apart < 0.5 * count if where == "bare" else apart > 50.0 * count
