"""The virtual skin: the same seed gives the same bytes, and its imperfections are those that were asked for."""

import itertools
import math
import statistics
from collections.abc import Sequence
from dataclasses import replace

import pytest

from coneskin.core.errors import SensorError, SkinConnectionError, SkinTimeout
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, Matrix, counts_of, measure
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Foam, Imperfections
from coneskin.skin.virtual.memory_source import MemorySource
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import MODELS, VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, Frame, FrameDecoder

from ..bench_top import CONE, UR10

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
        faults = FaultInjection(corrupt_every=7, garbage_every=5, cut_after=9)
        return bytes_of(VirtualSkin(SENSOR, [TOUCH], seed=seed, faults=faults, duration=0.05))

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
    counts = [f.touch_supply for f in frames_of(VirtualSkin(SENSOR, duration=1.5, imperfections=Imperfections(3.0)))]
    # 3 counts and rounding (1/12): 3.014; the estimate of 1500 frames is good to 1.8 %
    assert statistics.stdev(counts) == pytest.approx(math.hypot(3.0, math.sqrt(1 / 12)), rel=0.04)


def test_mains_swing_on_the_guides_and_on_nothing_else():
    press, still = ScriptedTouch(0.0, 1.0, 0.1, 2.0), Imperfections(noise_counts=0.0)
    humming = replace(still, mains_volts=0.1)
    quiet, loud = (
        frames_of(VirtualSkin(SENSOR, [press], duration=0.3, imperfections=each)) for each in (still, humming)
    )
    swing = [b.radial_c - a.radial_c for a, b in zip(quiet, loud, strict=True)][-40:]
    most = SENSOR.electronics.count_volts(0.1)
    assert max(swing) == pytest.approx(most, abs=1.0)
    assert min(swing) == pytest.approx(-most, abs=1.0)
    assert [frame.touch_supply for frame in quiet] == [frame.touch_supply for frame in loud]


def test_force_rises_within_its_time():
    touch = ScriptedTouch(1.0, 2.0, 0.1, 1.0, force=4.0, rise=0.1)
    assert [touch.force_at(t) for t in (0.9, 1.0, 1.05, 1.1, 1.5, 2.0, 2.1)] == pytest.approx([0, 0, 2, 4, 4, 0, 0])


@pytest.mark.parametrize(
    "touch",
    [
        ScriptedTouch(0.01, 0.09, 0.1, 1.0),
        ScriptedTouch(0.01, 0.025, 0.1, 1.0, rise=0.01),  # turns back on its way up
        ScriptedTouch(0.01, 0.09, 0.1, 1.0, rise=0.0),
        ScriptedTouch(0.01, math.inf, 0.1, 1.0, rise=0.05),
    ],
)
def test_the_foam_follows_the_script_in_closed_form(touch):
    foam, state, step = Foam(0.02, 0.6), 0.0, 1e-5
    for n in range(15000):
        if n % 500 == 0 and n * step not in (touch.start, touch.end):
            # steps of 10 us with the force in their middle: second order, (pi / 5 ms * 10 us)^2 / 24 of 5 N = 8e-6
            seated = foam.seated(state, touch.force_at(n * step))
            assert touch.seated_at(n * step, foam) == pytest.approx(seated, abs=2e-5)
        state = foam.advance(state, touch.force_at((n + 0.5) * step), step)
    assert touch.end == math.inf or touch.seated_at(10.0, foam) == 0.0


def test_a_touch_is_read_where_the_script_puts_it():
    quiet = Imperfections(noise_counts=0.0)
    skin = VirtualSkin(SENSOR, [TOUCH], imperfections=quiet, duration=0.12)
    readings = [read(SENSOR, frame) for frame in frames_of(skin)]
    assert {reading.level for reading in readings[:20] + readings[100:]} == {0.0}
    for reading in readings[30:50]:
        # a contact of 6.6 mm: the area error of 5 N, here 0.1 mm and 0.1 deg, comes with the exact field
        assert reading.centre == (pytest.approx(0.1, abs=4e-4), pytest.approx(2.0, abs=5e-3))


def test_a_touch_closes_when_the_foam_lets_it_and_opens_late():
    imperfections = Imperfections(noise_counts=0.0, foam=Foam(0.02, 0.6))
    # 0.9 N at once: the layers meet once 0.9 (1 - 0.6 exp(-t/tau)) is 0.5 N; 5 N released: 0.6 * 5 exp(-t/tau) holds
    # them together above that
    faint, firm = (ScriptedTouch(0.01, 0.2, 0.1, 2.0, force=force, rise=0.0) for force in (0.9, 5.0))
    for touch, closes, opens in (
        (faint, 0.01 + 0.02 * math.log(0.6 * 0.9 / (0.9 - 0.5)), 0.2 + 0.02 * math.log(0.6 * 0.9 / 0.5)),
        (firm, 0.01, 0.2 + 0.02 * math.log(0.6 * 5 / 0.5)),
    ):
        skin = VirtualSkin(SENSOR, [touch], imperfections=imperfections, duration=0.3)
        touched = [n for n, frame in enumerate(frames_of(skin)) if frame.touch_c > 0]
        assert touched[0] == pytest.approx(closes * 1e3, abs=1.0)  # the frame in which it happens
        assert touched[-1] == pytest.approx(opens * 1e3, abs=1.5)


def test_a_touch_added_among_others_changes_only_the_frames_from_its_start():
    slow, sudden = ScriptedTouch(0.0, 1.0, 0.1, 2.0, rise=0.1), ScriptedTouch(0.0203, 0.05, 0.3, 5.0, rise=0.0)
    early = frames_of(VirtualSkin(SENSOR, [slow, sudden], duration=0.06, seed=3))
    skin = VirtualSkin(SENSOR, [slow], duration=0.06, seed=3)
    late = []
    for _, frame in skin.frames():
        late.append(frame)
        if len(late) == 19:  # the frames up to the 24th are solved already
            skin.touch(sudden)
    assert late == early
    assert late[20] != frames_of(VirtualSkin(SENSOR, [slow], duration=0.06, seed=3))[20]


def test_every_count_is_that_of_the_full_field_model():
    lower = 300.0
    sensor = Sensor(CONE, lower_sheet_ohms=lower)
    real = Imperfections(noise_counts=0.0, settling_time=0.0)
    touches = [ScriptedTouch(0.002, 0.03, 0.05, 2.0), ScriptedTouch(0.01, 0.05, 0.09, 2.6, radius=0.005)]
    skin = VirtualSkin(sensor, touches, imperfections=real, duration=0.1, frame_length=52)
    model = FieldModel(SectorSheet.of_frustum(CONE), 1000.0, lower)
    compared = 0
    for number, frame in list(enumerate(frames_of(skin)))[::3]:
        sheets = []
        for part in (1, 2, 3):
            discs = []
            for touch in touches:
                seated = touch.seated_at((number + part / 3) * 1e-3, real.foam)
                if seated > 0.5:
                    radius, conductance = real.layers.touch(seated, touch.radius)
                    discs.append(Disc(touch.u, touch.phi, radius, conductance))
            if discs:
                sheets.append(model.admittance(model.discs(discs))[0].tolist())
        if len(sheets) < 3:
            continue
        for name, value in measure(sensor, sheets)._asdict().items():
            scale = sensor.electronics.current_full_scale if "current" in name else sensor.electronics.adc_volts
            # half a count from rounding, 0.001 for the model's tolerance and the millionth of a newton
            assert counts_of(frame)[name] == pytest.approx(value * 4095 / scale, abs=0.501)
        compared += 1
    assert compared > 20


@pytest.mark.parametrize("model", MODELS)
def test_damp_lifts_the_level_and_a_touch_with_it_is_still_read(model):
    damp = Imperfections(noise_counts=0.0, leak=2e-5)
    skin = VirtualSkin(SENSOR, [TOUCH], imperfections=damp, duration=0.05, model=model)
    readings = [read(SENSOR, frame) for frame in frames_of(skin)]
    # 50 kohm before two pull-downs of 10 kohm
    assert readings[5].level == pytest.approx(5 / 55, rel=0.02)
    assert readings[45].centre[0] == pytest.approx(
        0.1, abs=0.004
    )  # drawn to the middle of the sheet, by 2 % of the way


def test_settling_mixes_in_the_previous_phase():
    late = Imperfections(noise_counts=0.0, settling_time=-1 / (3000 * math.log(0.04)))  # 4 % left after a third of 1 ms
    dirty = VirtualSkin(SENSOR, imperfections=late, duration=0.002)
    frame = frames_of(dirty)[1]
    supply = frame.touch_supply
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

        def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
            pass

        def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
            self.asked += len(scenes)
            g, h = 1 / sensor.radial_ohms, 1 / sensor.angular_ohms
            return [((g, -g, 0.0, 0.0), (-g, g, 0.0, 0.0), (0.0, 0.0, h, -h), (0.0, 0.0, -h, h))] * len(scenes)

    model = Nothing()
    levels = {read(SENSOR, f).level > 0.01 for f in frames_of(VirtualSkin(SENSOR, [TOUCH], model=model, duration=0.1))}
    assert levels == {False}
    assert model.asked > 30  # while it rises, relaxes and ends


@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        (FaultInjection(drop_every=10), [n for n in range(100) if n % 10 != 9]),
        (FaultInjection(corrupt_every=10), [n for n in range(100) if n % 10 != 9]),
        (FaultInjection(garbage_every=3), list(range(100))),
        (FaultInjection(cut_after=42), [n for n in range(100) if n != 42]),
        (FaultInjection(stall_after=30), list(range(30))),
        (FaultInjection(stall_after=30, stall_frames=20), [*range(30), *range(50, 100)]),
        (FaultInjection(unplug_after=30), list(range(30))),
        (FaultInjection(duplicate_every=50), [*range(50), *range(49, 100), 99]),
        (FaultInjection(swap_every=50), [*range(49), 50, 49, *range(51, 99)]),
        (FaultInjection(replay_after=40), [*range(40), *range(40), *range(20)]),
        (FaultInjection(restart_after=60), [*range(60), *range(40)]),
    ],
)
def test_faults_do_what_they_say(faults, expected):
    data = bytes_of(VirtualSkin(SENSOR, faults=faults, duration=0.1, seed=5))
    assert [frame.sequence for frame in FrameDecoder().feed(data)] == expected


def test_a_gain_spoils_all_readings_of_its_input_and_nothing_else():
    good, half, dead = (
        FrameDecoder().feed(bytes_of(VirtualSkin(SENSOR, [TOUCH], faults=faults, duration=0.1, seed=5)))
        for faults in (
            FaultInjection(),
            FaultInjection(gain_after=60, gain_of="C", gain=0.5),
            FaultInjection(gain_after=60, gain_of="touch", gain=0.0),
        )
    )
    for n, frame in enumerate(good):
        ratio = 0.5 if n >= 60 else 1.0
        assert half[n] == frame._replace(touch_c=round(ratio * frame.touch_c), radial_c=round(ratio * frame.radial_c))
    assert dead[59] == good[59]
    assert dead[60] == good[60]._replace(touch_c=0, touch_d=0, touch_current=0)
    assert good[60].radial_c > 100
    with pytest.raises(SensorError, match=r"gain_of must be one of A, B, .* got 'E'"):
        FaultInjection(gain_of="E")


def test_the_memory_source_tells_when_the_bytes_came():
    with MemorySource(VirtualSkin(SENSOR, rate_hz=100, duration=0.05)) as source:
        arrivals = []
        for _ in range(5):
            assert len(source.read(1.0)) == FRAME_LENGTH
            arrivals.append(source.clock())
        with pytest.raises(SkinConnectionError, match=r"its time of 0.05 s is over"):
            source.read(1.0)
    assert arrivals == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05])


def test_the_memory_source_waits_no_longer_than_asked():
    with MemorySource(VirtualSkin(SENSOR, rate_hz=10)) as source:
        with pytest.raises(SkinTimeout):
            source.read(0.03)
        assert source.clock() == pytest.approx(0.03)
        source.sleep(0.3)
        assert len(source.read(0.0)) == 3 * FRAME_LENGTH  # what was due meanwhile comes at once
        assert source.clock() == pytest.approx(0.33)


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
        (lambda: VirtualSkin(SENSOR, model="comsol"), "must be one of field, ladder, got 'comsol'"),
        (lambda: Imperfections(settling_time=-1.0), "settling_time must be finite and not negative"),
        (lambda: FaultInjection(drop_every=-1), "faults.drop_every must not be negative, got -1"),
        (lambda: FaultInjection(stuck_channel="x"), "faults.stuck_channel must be one of touch_c"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(SensorError, match=words):
        make()
