"""A touch phase that has died reads as untouched; what the other two phases show must be a fault, in every place."""

import math
import random
from functools import lru_cache

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import TouchBegan
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.untouched import UntouchedCurrents, UntouchedGuides
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, measure
from coneskin.skin.virtual.field_contacts import FieldContacts
from coneskin.skin.virtual.imperfections import ContactLaw, Imperfections
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame

from ..bench_top import CONE, UR10, measured

SENSORS = {"forearm": Frustum(0.0375, 0.0375, 0.24, math.radians(350)), "cone": CONE, "upper arm": UR10}
TOUCH_PHASE = ("touch_c", "touch_d", "touch_current")


@lru_cache(maxsize=1)
def field() -> FieldContacts:
    return FieldContacts()


class DeadPhaseBench:
    """A detector whose touch phase always reads the same few counts, and their noise."""

    def __init__(self, sensor: Sensor, stuck: float, seed: int) -> None:
        self.sensor, self.detector = sensor, Detector(sensor)
        self._stuck, self._rng, self._count = stuck, random.Random(seed), 0

    def feed(self, contacts: list[LayerContact], times: int) -> int | None:
        """Feed frames of these contacts; the number of the first one that shows a touch or a fault."""
        parts, full = self.sensor.electronics, self.sensor.electronics.full_count
        y = field().admittances(self.sensor, [contacts])[0]
        values = measure(self.sensor, (y, y, y))._asdict()
        for k in range(times):
            counts = []
            for name, value in values.items():
                scale = parts.current_full_scale if name.endswith("current") else parts.adc_volts
                true = self._stuck * (name != "touch_current") if name in TOUCH_PHASE else value / scale * full
                counts.append(min(max(round(true + self._rng.gauss(0.0, 0.7)), 0), full))
            self.detector.feed(Frame(36, 0, 0, 0, self._count, 1000 * self._count, *counts[:12]), 1e-3 * self._count)
            self._count += 1
            if self.detector.touched or self.detector.fault is not None:
                return k
        return None


def missed(sensor: Sensor, stuck: float, places: int, rng: random.Random) -> list[tuple[float, float, float]]:
    """Places and forces at which a dead touch phase hides a touch for more than 5 frames."""
    cone, found = sensor.frustum, []
    for seed in range(places):
        u, phi = rng.random() * cone.slant, rng.random() * cone.wrap
        force = math.exp(rng.uniform(math.log(0.6), math.log(50.0)))
        contact = ContactLaw().touch(force)
        bench = DeadPhaseBench(sensor, stuck, seed)
        assert bench.feed([], 100) is None
        assert bench.detector.ready
        if bench.feed([LayerContact(u, phi, contact.siemens, contact.radius, contact.radius)], 6) is None:
            found.append((u, phi, force))
    return found


@pytest.mark.long
@pytest.mark.parametrize("stuck", [0.0, 30.0], ids=["zero", "stuck low"])
@pytest.mark.parametrize("name", SENSORS)
def test_a_dead_touch_phase_hides_no_touch(name, stuck):
    assert missed(Sensor(SENSORS[name]), stuck, 60, random.Random(1)) == []


@pytest.mark.promise("P10")
@pytest.mark.long
@pytest.mark.parametrize("name", SENSORS)
def test_a_dead_touch_phase_hides_no_touch_anywhere(name):
    assert missed(Sensor(SENSORS[name]), 0.0, 300, random.Random(2)) == []


def test_it_stays_a_fault_while_the_touch_lasts_and_passes_with_it():
    bench = DeadPhaseBench(Sensor(SENSORS["forearm"]), 0.0, 0)
    bench.feed([], 100)
    contact = ContactLaw().touch(20.0)
    here = [LayerContact(0.1, 2.0, contact.siemens, contact.radius, contact.radius)]
    bench.feed(here, 500)
    assert bench.detector.fault is Fault.GUIDE_DRIVEN
    for _ in range(400):
        bench.feed(here, 1)
    assert not bench.detector.ready
    for _ in range(100):
        bench.feed([], 1)
    assert bench.detector.ready


def test_a_leak_that_grows_slowly_is_no_contact():
    """Damp of up to 0.5 Mohm: the guides have a potential long before the level rises above its noise."""
    sensor = Sensor(SENSORS["forearm"])
    bench = DeadPhaseBench(sensor, 0.0, 0)
    assert bench.feed([], 100) is None
    for k in range(60):
        ohms = 5e8 / 1.1**k  # down to 2 Mohm, 10 % in each 100 ms; here the touch phase does not even see it
        leak = [LayerContact(0.12, 3.0, 1.0 / ohms, 0.02, 0.02)]
        if ohms < 3e7:
            break
        assert bench.feed(leak, 100) is None


def test_noise_of_ten_counts_is_no_contact():
    """Half of the noise of a guide that reads 0 is cut off; 1 % of the supply, 31 counts, is three deviations of it."""
    sensor = Sensor(SENSORS["forearm"])
    skin = VirtualSkin(sensor, model="ladder", duration=4.0, seed=3, imperfections=Imperfections(noise_counts=10.0))
    detector, guides, contradictions = Detector(sensor), UntouchedGuides(UntouchedCurrents(sensor, 0.0)), 0
    for time, frame in skin.frames():
        contradictions += guides.contradict(frame, 0.0, 1e-3)
        assert detector.feed(frame, time) == []
        assert time < 1.5 or not detector._guides.contradict(frame, 0.0, 1e-3)
    assert contradictions > 4  # where no noise was learned


def test_more_noise_than_the_thresholds_bear_is_a_fault():
    sensor = Sensor(SENSORS["forearm"])
    skin = VirtualSkin(sensor, model="ladder", duration=3.0, seed=3, imperfections=Imperfections(noise_counts=17.0))
    detector, events = Detector(sensor), []
    for time, frame in skin.frames():
        events += detector.feed(frame, time)
    assert Fault.NOISE in {event.fault for event in events}
    assert not detector.ready
    assert not any(isinstance(event, TouchBegan) for event in events)


@pytest.mark.parametrize(("deviations", "contact"), [(6.0, False), (8.0, True)])
@pytest.mark.parametrize("sign", [1, -1], ids=["both move", "they part"])
@pytest.mark.parametrize("pair", [("radial_c", "radial_d"), ("angular_a", "angular_b")])
def test_what_noise_does_once_in_twelve_days_is_no_contact(pair, sign, deviations, contact):
    """Six deviations of a mean or a difference of two readings are once in 1e9 frames; beyond eight nothing hides."""
    sensor, noise = Sensor(UR10), 10.0
    currents, rest = UntouchedCurrents(sensor, 0.0), measured(sensor)._replace(**dict.fromkeys(pair, 200))
    currents.noise = noise
    guides, moved = UntouchedGuides(currents), round(deviations * noise / math.sqrt(2.0))
    assert not guides.contradict(rest, 0.0, 1e-3)
    moves = dict(zip(pair, (200 + moved, 200 + sign * moved), strict=True))
    assert guides.contradict(rest._replace(**moves), 0.0, 1e-3) is contact
