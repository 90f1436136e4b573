"""The virtual skin: the same seed gives the same bytes, and its imperfections are those that were asked for."""

import itertools
import math
import statistics

import pytest

from coneskin.errors import SensorError, SkinConnectionError, SkinTimeout
from coneskin.skin.circuit import Matrix
from coneskin.skin.faults import Faults
from coneskin.skin.memory_source import ManualClock, MemorySource
from coneskin.skin.reading import read
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual import Imperfections, ScriptedTouch, VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, Decoder, Frame

from .bench_top import CONE, UR10

SENSOR = Sensor(UR10)
TOUCH = ScriptedTouch(0.02, 0.06, 0.1, 2.0)


def frames_of(skin: VirtualSkin) -> list[Frame]:
    return [frame for _, frame in skin.frames()]


def bytes_of(skin: VirtualSkin) -> bytes:
    data = b""
    try:
        for _, packet in skin.packets():
            data += packet
    except SkinConnectionError:
        pass
    return data


def test_the_same_seed_gives_the_same_bytes_and_another_does_not():
    def data(seed: int) -> bytes:
        faults = Faults(corrupt_every=7, garbage_every=5, cut_after=9)
        return bytes_of(VirtualSkin(SENSOR, [TOUCH], seed=seed, faults=faults, duration=0.1))

    assert data(1) == data(1)
    assert data(1) != data(2)


def test_frames_come_at_the_rate_and_carry_its_clock():
    skin = VirtualSkin([SENSOR, Sensor(CONE, 1)], rate_hz=500, duration=0.1)
    found = list(skin.frames())
    assert len(found) == 100
    assert [frame.sensor for _, frame in found[:4]] == [0, 1, 0, 1]
    assert [frame.sequence for _, frame in found[:4]] == [0, 0, 1, 1]
    steps = {b.clock_us - a.clock_us for a, b in itertools.pairwise(f for _, f in found if f.sensor == 0)}
    assert steps <= {1999, 2000, 2001}  # 500 Hz in whole microseconds
    assert found[-1][0] == pytest.approx(0.1)


def test_noise_has_the_width_that_was_asked_for():
    counts = [f.supply for f in frames_of(VirtualSkin(SENSOR, duration=5.0, imperfections=Imperfections(3.0)))]
    # 3 counts and rounding (1/12): 3.014; the estimate of 5000 frames is good to 1 %, so 4 sigma
    assert statistics.stdev(counts) == pytest.approx(math.hypot(3.0, math.sqrt(1 / 12)), rel=0.04)


def test_force_rises_within_its_time_and_conducts_above_its_threshold():
    touch = ScriptedTouch(1.0, 2.0, 0.1, 1.0, force=4.0, rise=0.1)
    assert [touch.force_at(t) for t in (0.9, 1.0, 1.05, 1.1, 1.5, 2.0, 2.1)] == pytest.approx([0, 0, 2, 4, 4, 0, 0])
    law = Imperfections()
    assert law.conductance(0.5) == 0.0  # the paper's threshold force, section 4.2
    assert law.conductance(1.5) == pytest.approx(1e-3)


def test_a_touch_is_read_where_the_script_puts_it():
    quiet = Imperfections(noise_counts=0.0)
    skin = VirtualSkin(SENSOR, [TOUCH], imperfections=quiet, duration=0.08)
    readings = [read(SENSOR, frame) for frame in frames_of(skin)]
    assert {reading.level for reading in readings[:20] + readings[60:]} == {0.0}
    for reading in readings[30:50]:
        assert (reading.u, reading.phi) == (pytest.approx(0.1, abs=2e-4), pytest.approx(2.0, abs=3e-3))


def test_settling_mixes_in_the_previous_phase():
    dirty = VirtualSkin(SENSOR, imperfections=Imperfections(noise_counts=0.0, settling=0.04), duration=0.002)
    frame = frames_of(dirty)[1]
    supply = frame.supply
    # C stood at the supply and D at ground in the angular phase before
    assert (frame.touch_c, frame.touch_d) == (pytest.approx(0.04 * supply, abs=1), 0)
    assert (frame.angular_b, frame.angular_a) == (pytest.approx(0.04 * supply, abs=1), 0)


def test_a_touch_can_be_added_while_it_runs():
    skin = VirtualSkin(SENSOR, duration=0.2)
    levels = []
    for time, frame in skin.frames():
        if len(levels) == 50:
            skin.touch(ScriptedTouch(time, math.inf, 0.1, 2.0))
        levels.append(read(SENSOR, frame).level)
    assert max(levels[:50]) < 0.01
    assert min(levels[60:]) > 0.5


def test_another_contact_model_is_asked():
    class Nothing:
        asked = 0

        def admittance(self, sensor: Sensor, contacts: object) -> Matrix:
            assert contacts is not None
            self.asked += 1
            g, h = 1 / sensor.radial_ohms, 1 / sensor.angular_ohms
            return ((g, -g, 0.0, 0.0), (-g, g, 0.0, 0.0), (0.0, 0.0, h, -h), (0.0, 0.0, -h, h))

    model = Nothing()
    levels = {read(SENSOR, f).level > 0.01 for f in frames_of(VirtualSkin(SENSOR, [TOUCH], model=model, duration=0.1))}
    assert levels == {False}
    assert model.asked > 10


@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        (Faults(drop_every=10), [n for n in range(100) if n % 10 != 9]),
        (Faults(corrupt_every=10), [n for n in range(100) if n % 10 != 9]),
        (Faults(garbage_every=3), list(range(100))),
        (Faults(cut_after=42), [n for n in range(100) if n != 42]),
        (Faults(stall_after=30), list(range(30))),
        (Faults(stall_after=30, stall_frames=20), [*range(30), *range(50, 100)]),
        (Faults(unplug_after=30), list(range(30))),
        (Faults(duplicate_every=50), [*range(50), *range(49, 100), 99]),
        (Faults(swap_every=50), [*range(49), 50, 49, *range(51, 99)]),
        (Faults(replay_after=40), [*range(40), *range(40), *range(20)]),
        (Faults(restart_after=60), [*range(60), *range(40)]),
    ],
)
def test_faults_do_what_they_say(faults, expected):
    data = bytes_of(VirtualSkin(SENSOR, faults=faults, duration=0.1, seed=5))
    assert [frame.sequence for frame in Decoder().feed(data)] == expected


def test_the_memory_source_tells_when_the_bytes_came():
    clock = ManualClock(100.0)
    with MemorySource(VirtualSkin(SENSOR, rate_hz=100, duration=0.05), clock, clock.sleep) as source:
        arrivals = []
        for _ in range(5):
            assert len(source.read(1.0)) == FRAME_LENGTH
            arrivals.append(clock())
        with pytest.raises(SkinConnectionError, match=r"its time of 0.05 s is over"):
            source.read(1.0)
    assert arrivals == pytest.approx([100.01, 100.02, 100.03, 100.04, 100.05])


def test_the_memory_source_waits_no_longer_than_asked():
    clock = ManualClock()
    with MemorySource(VirtualSkin(SENSOR, rate_hz=10), clock, clock.sleep) as source:
        with pytest.raises(SkinTimeout):
            source.read(0.03)
        assert clock() == pytest.approx(0.03)
        clock.sleep(0.3)
        assert len(source.read(0.0)) == 3 * FRAME_LENGTH  # what was due meanwhile comes at once
        assert clock() == pytest.approx(0.33)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ScriptedTouch(2.0, 1.0, 0.1, 0.1), "must end after it starts"),
        (lambda: ScriptedTouch(0.0, 1.0, math.nan, 0.1), "touch.u must be finite"),
        (lambda: VirtualSkin([]), "at least one sensor"),
        (lambda: VirtualSkin(SENSOR, rate_hz=0.0), "rate_hz must be finite and above 0 Hz"),
        (lambda: VirtualSkin(SENSOR, duration=-1.0), "duration must be above 0 s"),
        (lambda: VirtualSkin(SENSOR, [ScriptedTouch(0, 1, 5.0, 0.1)]), "a touch must lie on sensor 0/0: u up to 0.434"),
        (lambda: VirtualSkin(SENSOR, [ScriptedTouch(0, 1, 0.1, 0.1, sensor="x")]), "touch.sensor must be one of"),
        (lambda: Faults(drop_every=-1), "faults.drop_every must not be negative, got -1"),
        (lambda: Faults(stuck_channel="x"), "faults.stuck_channel must be one of touch_c"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(SensorError, match=words):
        make()
