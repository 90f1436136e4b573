"""When a place is worked out: never before a touch has begun, and seldom after."""

import itertools
import math
import random
from collections import Counter
from dataclasses import replace

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault, TouchBegan, TouchMoved
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import UntouchedCurrents, UntouchedGuides, UntouchedLeak
from coneskin.skin.detection.place.place_estimate import PlaceEstimator
from coneskin.skin.detection.place.single_contact import ALTERED, SingleContactTest
from coneskin.skin.detection.place.touch_place import TouchPlace
from coneskin.skin.electronics import Electronics, Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.sheet_functions import RobinFunction
from coneskin.skin.tolerance import IDEAL_SHEETS
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.wire import Frame

from ...bench_top import UR10, measured

SENSOR = Sensor(UR10, name="forearm", tolerance=IDEAL_SHEETS)
COUNTS = Frame._fields[6:-1]
LEARNED = 200  # frames
OFTEN = 8  # frames; an estimate serves for as many

pytestmark = pytest.mark.pure  # they count calls


class CountedTouch:
    """A detector that has learned, and how often its decoder works out a place."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, confirm_frames: int = 1) -> None:
        self.detector = Detector(SENSOR, DetectorSettings(confirm_frames=confirm_frames))
        self.calls: Counter[str] = Counter()
        self._count, self._rng = 0, random.Random(5)
        for kind, name in (
            (PlaceEstimator, "estimate"),
            (RobinFunction, "value_and_gradient"),
        ):
            monkeypatch.setattr(kind, name, self._counted(name, getattr(kind, name)))
        for _ in range(LEARNED):
            self.feed(())

    def _counted(self, name, method):
        def counted(*args):
            self.calls[name] += 1
            return method(*args)

        return counted

    def feed(self, contacts):
        frame = measured(SENSOR, contacts)._asdict()
        counts = {n: max(0, round(frame[n] + self._rng.gauss(0.0, 0.7))) for n in COUNTS}
        stamp = {"sequence": self._count & 0xFFFF, "clock_us": 1000 * self._count}
        self._count += 1
        return self.detector.feed(Frame(**{**frame, **counts, **stamp}), 1e-3 * self._count)


def press(siemens: float, u: float = 0.2) -> list[LayerContact]:
    return [LayerContact(u, 1.0, siemens)]


@pytest.mark.parametrize("confirm_frames", [1, 2])
def test_what_stops_an_arm_waits_for_no_place(monkeypatch, confirm_frames):
    touch = CountedTouch(monkeypatch, confirm_frames)
    events = [event for _ in range(confirm_frames) for event in touch.feed(press(1e-3))]
    (began,) = events
    assert isinstance(began, TouchBegan)
    assert not touch.calls
    assert began.covariance is None
    assert not began.location_valid
    assert began.doubt
    assert began.u == pytest.approx(0.2, abs=0.005)
    assert began.phi == pytest.approx(1.0, abs=0.05)
    assert touch.detector.reading_now.covariance is None
    touch.feed(press(1e-3))
    assert touch.calls["estimate"] == 1
    assert touch.detector.reading_now.covariance is not None


def test_no_place_is_certain_before_it_is_worked_out(monkeypatch):
    monkeypatch.setattr(SingleContactTest, "feed", lambda *_: "")
    touch = CountedTouch(monkeypatch, 2)
    touch.feed(press(1e-3))
    (began,) = touch.feed(press(1e-3))
    assert not began.location_valid
    assert began.doubt
    touch.feed(press(1e-3))
    assert touch.detector.reading_now.location_valid


def test_a_touch_that_is_not_confirmed_costs_no_place(monkeypatch):
    touch = CountedTouch(monkeypatch, 2)
    for _ in range(5):
        assert touch.feed(press(1e-3)) == []
        touch.feed(())
    assert not touch.calls


@pytest.mark.parametrize("slide", [0.0, 5e-4])
def test_a_press_that_grows_or_slides_is_worked_out_once_in_eight_frames(monkeypatch, slide):
    touch = CountedTouch(monkeypatch)
    at = []
    for n in range(100):
        before = touch.calls["estimate"]
        touch.feed(press(3e-4 * 1.05**n, 0.15 + slide * n))
        if touch.calls["estimate"] > before:
            at.append(n)
    gaps = [later - sooner for sooner, later in itertools.pairwise(at)]
    assert at[0] == 1
    assert min(gaps) >= OFTEN
    assert max(gaps) <= 2 * OFTEN


def test_the_covariance_is_told_only_while_the_estimate_stands(monkeypatch):
    touch = CountedTouch(monkeypatch)
    for _ in range(3):
        touch.feed(press(3e-4))
    assert touch.detector.reading_now.covariance is not None
    events = []
    for _ in range(4):
        events += touch.feed(press(9e-4))
    reading = touch.detector.reading_now
    assert touch.calls["estimate"] == 1
    assert reading.covariance is None
    assert reading.radius is None
    assert any(isinstance(event, TouchMoved) and event.covariance is None for event in events)
    for _ in range(OFTEN):
        touch.feed(press(9e-4))
    assert touch.detector.reading_now.covariance is not None


def test_the_first_certain_place_of_a_press_that_grows_is_told_with_its_covariance(monkeypatch):
    touch = CountedTouch(monkeypatch)
    events = [event for n in range(20) for event in touch.feed(press(min(2e-4 * 1.4**n, 5e-3)))]
    first = next(event for event in events if event.location_valid)
    assert first.covariance is not None


def test_a_rest_sharpens_the_place_with_few_estimates(monkeypatch):
    touch = CountedTouch(monkeypatch)
    told = []
    for _ in range(128):
        touch.feed(press(1e-3))
        told.append(touch.detector.reading_now.covariance)
    assert touch.calls["estimate"] <= 128 // OFTEN
    assert told[-1][0] < 0.1 * told[1][0]
    assert told[-1][2] < 0.1 * told[1][2]


def test_a_centre_far_off_the_sheet_has_a_finite_velocity():
    """Counts beyond the converter's range put the electrical centre thousands of sheets away."""
    sensor = Sensor(Frustum(0.012, 0.08, 0.2), electronics=Electronics(), polarity=Polarity("A", "D"))
    currents = UntouchedCurrents(sensor, 0.0)
    learned = currents, UntouchedLeak(sensor, 1e-3), UntouchedGuides(currents)
    places = TouchPlace(sensor, DetectorSettings(), *learned)
    good = measured(sensor, [LayerContact(0.1, 1.0, 1e-3)])
    far = dict(zip(COUNTS, (48634, 64561, 1089, 33060, 10132, 7643, 53009, 53330, 48986), strict=False))
    for number, frame in enumerate((good, good, good._replace(**far))):
        place = places.feed(frame, read(sensor, frame), 0.9, 1e-3 * number, 1e-3)
    assert math.hypot(*place.velocity) < math.inf
    assert 0.0 <= place.u <= sensor.frustum.slant


@pytest.mark.parametrize(("radial", "angular", "certain"), [(1.0, 1.0, True), (0.97, 1.0, False), (1.0, 0.97, False)])
@pytest.mark.long
def test_no_place_is_certain_once_a_sheet_has_changed(radial, angular, certain):
    """An electrode of which a part peels off moves every place: the currents that are learned anew do not tell it."""
    detector, rng = Detector(SENSOR), random.Random(5)
    for number in range(6 * LEARNED):
        contact = LayerContact(0.2, 1.5, 2e-3)
        frame = measured(SENSOR, (contact,) if number > 5 * LEARNED else ())._asdict()
        if number > 2 * LEARNED:
            frame |= {"radial_current": radial * frame["radial_current"]}
            frame |= {"angular_current": angular * frame["angular_current"]}
        counts = {n: max(0, round(frame[n] + rng.gauss(0.0, 0.7))) for n in COUNTS}
        detector.feed(Frame(**{**frame, **counts, "sequence": number, "clock_us": 5000 * number}), 0.005 * number)
    touch = detector.reading_now
    assert touch is not None
    assert (touch.location_valid, touch.doubt == ALTERED) == (certain, not certain)


@pytest.mark.parametrize(
    ("upper", "lower", "named"),
    [
        (1.0, 1.0, ""),
        (1.0077, 1.0, ""),  # of the worst sheets, a layer that is 1 K warmer than the other one
        (0.8, 0.81, ""),  # another day's warmth and damp
        (1.044, 1.0, "the upper sheet, or its bond to A or B"),  # three tenths of electrode A or B have peeled off
        (1.0, 1.017, "the lower sheet, or its bond to C or D"),
        (0.97, 1.0, "the upper sheet, or its bond to A or B"),
        (1.3, 1.3, "the gain of the current, or both sheets"),
    ],
)
def test_no_place_is_certain_where_the_sheets_are_not_what_they_were_known_to_be(upper, lower, named):
    """What peels off before the start is learned with the currents: only what they were before can tell it."""
    detector, rng, events = Detector(replace(SENSOR, known_ohms=(1000.0 / upper, 1000.0 / lower))), random.Random(5), []
    for number in range(4 * LEARNED):
        contact = LayerContact(0.2, 1.5, 2e-3)
        frame = measured(SENSOR, (contact,) if number > 3 * LEARNED else ())._asdict()
        counts = {n: max(0, round(frame[n] + rng.gauss(0.0, 0.7))) for n in COUNTS}
        events += detector.feed(
            Frame(**{**frame, **counts, "sequence": number, "clock_us": 5000 * number}), 0.005 * number
        )
    touch = detector.reading_now
    assert touch is not None
    assert (touch.location_valid, touch.doubt == ALTERED) == (not named, bool(named))
    told = [event.detail for event in events if isinstance(event, SkinFault)]
    assert told == ([detector.altered] if named else []), "once"
    assert detector.altered.startswith(named)
    assert bool(named) is (f"upper {100.0 * (upper - 1.0):+.1f} %, lower" in detector.altered)


def test_a_peel_that_goes_on_slowly_is_told_once_it_is_more_than_drift():
    """The currents follow it, at most by the drift that is allowed."""
    settings, rng, faults = DetectorSettings(current_drift=1e-3), random.Random(5), {}
    detector = Detector(replace(SENSOR, known_ohms=(1000.0, 1000.0)), settings)
    frame = measured(SENSOR, ())._asdict()
    for number in range(7000):
        current = frame["radial_current"] * (1.0 - 0.03 * number / 8000)
        counts = {n: max(0, round(frame[n] + rng.gauss(0.0, 0.7))) for n in COUNTS}
        counts["radial_current"] = round(current + rng.gauss(0.0, 0.7))
        for event in detector.feed(
            Frame(**{**frame, **counts, "sequence": number, "clock_us": 5000 * number}), 0.005 * number
        ):
            faults[number] = event
    ((number, event),) = faults.items()
    assert event.fault is Fault.CURRENT_CHANGED
    assert 0.015 < 0.03 * number / 8000 < 0.025
    assert detector.ready, "and the arm may be guarded again, without a place"
    assert detector.altered == event.detail
