"""The name of a fault that lasts: what is broken, whatever touches the sensor, and no other name without need."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection import fault_diagnosis
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault, TouchBegan, TouchEvent
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))
TOUCH = ScriptedTouch(0.08, 0.5, 0.07, 1.7, force=12.0, rise=0.001)
BREAKS = 80  # frame


def faults_of(faults, touches=(TOUCH,), polarity=None, duration=0.3, **skin):
    """The faults that a detector reports of a virtual skin, and whether it was touched."""
    sensor = Sensor(FOREARM, polarity=polarity or Polarity())
    detector, events = Detector(sensor), []
    device = VirtualSkin(sensor, touches, model="ladder", duration=duration, faults=faults, **skin)
    for time, frame in device.frames():
        events += detector.feed(frame, time)
    return [event for event in events if isinstance(event, SkinFault)], events


def test_no_frame_builds_more_than_one_hypothesis(monkeypatch):
    built, most = [], 0
    phases = fault_diagnosis._phases
    monkeypatch.setattr(fault_diagnosis, "_phases", lambda *broken: built.append(broken) or phases(*broken))
    sensor = Sensor(FOREARM)
    detector = Detector(sensor)
    breaks = FaultInjection(wiring=WiringFaults(("A",)), wiring_after=BREAKS)
    for time, frame in VirtualSkin(sensor, (TOUCH,), model="ladder", duration=0.3, faults=breaks).frames():
        before = len(built)
        detector.feed(frame, time)
        most = max(most, len(built) - before)
    assert (most, len(built)) == (1, len(fault_diagnosis._list_hypotheses(sensor)))


def short(one, other):
    return WiringFaults(shorts=((one, other),))


#: what breaks -> its name while touched; the electrodes of the usual polarity, B and C driven
NAMES = {
    WiringFaults(("A",)): Fault.OPEN_A,
    WiringFaults(("B",)): Fault.OPEN_B,
    WiringFaults(("C",)): Fault.OPEN_C,
    WiringFaults(("D",)): Fault.OPEN_D,
    short("A", "supply"): Fault.OPEN_UPPER,
    short("B", "supply"): Fault.OPEN_UPPER,
    short("C", "supply"): Fault.OPEN_LOWER,
    short("D", "supply"): Fault.OPEN_LOWER,
    short("A", "B"): Fault.SHORT_UPPER,
    short("C", "D"): Fault.SHORT_LOWER,
    short("A", "ground"): Fault.LEAK,
    short("B", "ground"): Fault.SHORT_UPPER,
    short("C", "ground"): Fault.SHORT_LOWER,
    short("D", "ground"): Fault.LEAK,
    short("A", "rail"): Fault.SHORT_UPPER,
    short("B", "rail"): Fault.GUIDE_DRIVEN,
    short("C", "rail"): Fault.GUIDE_DRIVEN,
    short("D", "rail"): Fault.SHORT_LOWER,
}
#: a touch at which the first name is another one: (u, phi, what breaks)
RENAMED = [
    (0.232, 0.15, short("C", "rail"), Fault.GUIDE_DRIVEN),
    (0.012, 5.9, short("B", "supply"), Fault.OPEN_UPPER),
    (0.010, 0.1, short("A", "D"), Fault.LAYERS_CLOSED),
]


@pytest.mark.parametrize("wiring", NAMES, ids=lambda w: "-".join(w.opened or w.shorts[0]))
def test_what_breaks_in_a_touch_is_named(wiring):
    polarity = Polarity("A", "D") if list(NAMES).index(wiring) % 2 else Polarity()
    mirror = str.maketrans("ABCD", "BADC") if polarity.radial == "A" else {}
    here = WiringFaults(
        tuple(name.translate(mirror) for name in wiring.opened),
        tuple(
            (one.translate(mirror), other.translate(mirror) if len(other) == 1 else other)
            for one, other in wiring.shorts
        ),
    )
    expected = NAMES[wiring]
    if expected.name[-2] == "_":
        expected = Fault[expected.name[:-1] + expected.name[-1].translate(mirror)]
    faults, _ = faults_of(FaultInjection(wiring_after=BREAKS + 20, wiring=here), polarity=polarity)
    assert faults[-1].fault is expected
    assert faults[0].sequence <= BREAKS + 20 + (60 if expected is Fault.GUIDE_DRIVEN else 3)


@pytest.mark.parametrize(("u", "phi", "wiring", "name"), RENAMED)
def test_a_first_name_that_is_wrong_does_not_stay(u, phi, wiring, name):
    touch = ScriptedTouch(0.08, 0.5, u, phi, force=40.0, rise=0.001)
    faults, _ = faults_of(FaultInjection(wiring_after=BREAKS, wiring=wiring), [touch], duration=0.45)
    assert faults[0].fault is not name
    assert faults[-1].fault is name


def test_no_place_is_certain_before_a_switch_that_is_stuck_is_named():
    """It looks like a touch elsewhere; 280 mm off, and certain for 49 frames, until they were counted."""
    touch = ScriptedTouch(0.119, 1.0, 0.0674, 5.914, force=3.467, rise=0.001)
    stuck = FaultInjection(wiring_after=79, wiring=short("C", "rail"))
    faults, events = faults_of(stuck, [touch], Polarity("A", "C"), duration=0.35)
    assert faults[-1].fault is Fault.GUIDE_DRIVEN
    assert any(isinstance(event, TouchBegan) for event in events)
    assert not any(isinstance(event, TouchEvent) and event.location_valid for event in events)


def test_the_driven_potentials_name_an_open_wire_without_a_touch():
    faults = FaultInjection(wiring_after=BREAKS, wiring=WiringFaults(("A",)))
    assert [event.fault for event in faults_of(faults, ())[0]] == [Fault.OPEN_UPPER]
    named = faults_of(faults, (), frame_length=52)[0]
    assert [event.fault for event in named] == [Fault.OPEN_UPPER, Fault.OPEN_A]
    assert named[-1].detail == "A open"


def test_a_wire_that_is_mended_and_another_that_breaks_are_two_faults():
    sensor = Sensor(FOREARM)
    detector, events = Detector(sensor), []
    parts = [
        VirtualSkin(sensor, model="ladder", duration=0.3, seed=k, faults=FaultInjection(wiring_after=0, wiring=wiring))
        for k, wiring in enumerate((WiringFaults(), short("A", "ground"), WiringFaults(), WiringFaults(("C",))))
    ]
    for k, skin in enumerate(parts):
        for time, frame in skin.frames():
            later = frame._replace(sequence=frame.sequence + 300 * k, clock_us=frame.clock_us + 300_000 * k)
            events += detector.feed(later, time + 0.3 * k)
    names = [(event.fault, event.detail) for event in events if isinstance(event, SkinFault)]
    assert names == [(Fault.LEAK, ""), (Fault.LEAK, "A joined to ground"), (Fault.OPEN_LOWER, "")]
    assert not any(isinstance(event, TouchBegan) for event in events)


@pytest.mark.long
def test_a_gain_that_is_off_is_not_taken_for_a_broken_wire():
    rng = random.Random(4)
    for electrode in "ABCD":
        u, phi = rng.uniform(0.05, 0.2), rng.uniform(1.0, 5.0)
        sensor = Sensor(FOREARM)
        skin = VirtualSkin(sensor, [ScriptedTouch(0.08, 0.5, u, phi, force=20.0)], model="ladder", duration=0.35)
        detector, events = Detector(sensor), []
        names = {"A": ("angular_a",), "B": ("angular_b",), "C": ("touch_c", "radial_c"), "D": ("touch_d", "radial_d")}
        for time, frame in skin.frames():
            spoilt = frame._replace(**{name: round(0.9 * getattr(frame, name)) for name in names[electrode]})
            events += detector.feed(spoilt, time)
        assert {event.fault for event in events if isinstance(event, SkinFault)} == {Fault.GUIDES_DISAGREE}
