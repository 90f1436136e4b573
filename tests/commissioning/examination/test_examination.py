"""Examination of a virtual skin in simulated time: a right one is found right, each wrong one is named."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from coneskin.commissioning.examination.examination import Doctor, set_sensor_keys
from coneskin.commissioning.examination.skin_examination import SensorStatistics, _timing, examine_sensor
from coneskin.commissioning.examination.wires import touch_places
from coneskin.core.finding import Finding
from coneskin.scene.reader import parse_scene
from coneskin.skin.detection.events import SkinFault, TouchMoved
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.memory_source import MemorySource
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame

TEXT = """\
[[link]]
name = "tube"
[[link.sensor]]
name = "skin"
radius1_mm = 41
radius2_mm = 40
height_mm = 240
wrap_deg = 330
[source]
kind = "serial"
port = "/dev/nothing"
baud = 115200
"""
#: wires, electrode that the firmware drives in the angular phase, and what the scene must have
MENDED = [
    ("BACD", "C", {"radial_positive": "A"}),
    ("ABCD", "D", {"angular_positive": "D"}),
    ("BACD", "D", {"radial_positive": "A", "angular_positive": "D"}),
]


class Finger:
    """What touches the virtual skin on the source's own clock."""

    def __init__(self, skin: VirtualSkin, source: MemorySource) -> None:
        self._skin, self._source = skin, source

    def touch(self, u: float, phi: float, force: float, duration: float, sensor: str) -> None:
        start = self._source.clock() + 0.01
        self._skin.touch(ScriptedTouch(start, start + duration, u, phi, force=force, sensor=sensor))

    def release(self) -> None:
        self._skin.release(self._source.clock() + 0.01)


def examine(text: str = TEXT, touches: bool = True, **skin_options: object) -> Doctor:
    """The examination of a skin that may differ from the scene."""
    scene = parse_scene(text)
    sensors = skin_options.pop("sensors", parse_scene(TEXT).sensors[0].sensor)
    options = {"rate_hz": 250.0, "model": "ladder", **skin_options}
    skin = VirtualSkin(sensors, **options)  # type: ignore[arg-type]
    source = MemorySource(skin)
    doctor = Doctor(scene, touches=touches, clock=source.clock)
    assert scene.source is not None
    with source:
        doctor.examine_skin(source, scene.source.settings, Finger(skin, source))
    return doctor


def finding(doctor: Doctor, item: str) -> Finding:
    (found,) = (one for one in doctor.findings if one.item == item)
    return found


@cache
def right() -> Doctor:
    return examine()


def test_a_right_skin_is_found_right() -> None:
    doctor = right()
    assert {(one.verdict, one.remedy) for one in doctor.findings if one.item != "skin, sheets"} == {("ok", "")}
    assert "has peeled off before cannot be told: coneskin commission" in finding(doctor, "skin, sheets").remedy
    assert doctor.patches == []
    assert finding(doctor, "skin, rate").value == "250 frames/s"
    assert finding(doctor, "line").value == "250 frames/s take 78 % of 115200 baud"


@pytest.mark.parametrize("wires", ["CDAB", "ACBD"])
@pytest.mark.long
def test_wires_that_must_be_moved_are_named(wires: str) -> None:
    doctor = examine(wires=wires)
    found = finding(doctor, "skin, wires")
    moved = [pair for pair in zip("ABCD", wires, strict=True) if pair[0] != pair[1]]
    assert found.value == "; ".join(f"terminal {terminal} has electrode {letter}" for terminal, letter in moved)
    assert found.remedy.endswith(", ".join(f"{terminal} to {letter}" for terminal, letter in moved))
    assert doctor.patches == []


@pytest.mark.long
@pytest.mark.parametrize(("wires", "firmware", "keys"), MENDED)
def test_what_the_scene_can_mend_is_patched_and_then_read_where_it_is_touched(
    wires: str, firmware: str, keys: dict[str, str]
) -> None:
    plain = parse_scene(TEXT).sensors[0].sensor
    made = replace(plain, polarity=Polarity("B", firmware))  # type: ignore[arg-type]
    doctor = examine(wires=wires, sensors=made)
    assert finding(doctor, "skin, wires").verdict == "bad"
    mirrored = finding(doctor, "skin, chi-squared")
    assert (mirrored.verdict, mirrored.value) == ("not tried", "the wires are not in order")
    assert [(patch.sensor, patch.keys) for patch in doctor.patches] == [("skin", keys)]
    patched = parse_scene(set_sensor_keys(TEXT, 0, keys)).sensors[0].sensor
    place = 0.07, math.radians(80.0)
    read, faults = _touch(made, patched, wires, place)
    assert faults == []
    assert read is not None
    assert math.hypot(read.u - place[0], 0.04 * (read.phi - place[1])) < 0.003
    read, faults = _touch(made, plain, wires, place)
    astray = read is None or math.hypot(read.u - place[0], 0.04 * (read.phi - place[1])) > 0.05
    assert astray or faults, "without the patch it is mirrored, or contradicts itself"


def _touch(
    made: Sensor, read: Sensor, wires: str, place: tuple[float, float]
) -> tuple[TouchMoved | None, list[SkinFault]]:
    """The last place of a touch of 0.6 s, read as a scene says, if it has one, and the faults."""
    touch = ScriptedTouch(0.5, 1.1, *place, force=8.0, radius=0.006)
    skin = VirtualSkin(made, [touch], rate_hz=250.0, wires=wires, duration=1.1)
    stream, events = TouchStream([read]), []
    for time, data in skin.packets():
        if time > 1.05:
            break
        events += stream.feed(data, time)
    places = [event for event in events if isinstance(event, TouchMoved)]
    return places[-1] if places else None, [event for event in events if isinstance(event, SkinFault)]


@pytest.mark.parametrize(
    ("skin", "item", "verdict", "said"),
    [
        ({"imperfections": Imperfections(clock_ratio=2.0)}, "skin, clock", "bad", "2.000 device seconds in a second"),
        ({"imperfections": Imperfections(clock_ratio=1.013)}, "skin, clock", "bad", "1.013 device seconds"),
        ({"imperfections": Imperfections(noise_counts=0.0)}, "skin, noise", "bad", "radial_current 0.0"),
        ({"imperfections": Imperfections(noise_counts=12.0)}, "skin, noise", "warning", "touch_supply 1"),
        ({"imperfections": Imperfections(leak=2e-5)}, "skin, guides", "bad", "; 20 uS join the layers"),
        ({"imperfections": Imperfections(supply_ratio=0.8)}, "skin, supply", "bad", "2482 counts"),
        ({"rate_hz": 150.0}, "skin, rate", "warning", "150 frames/s"),
        ({"rate_hz": 50.0}, "skin, rate", "bad", "50 frames/s"),
        ({"rate_hz": 320.0}, "line", "warning", "100 % of 115200 baud"),
    ],
)
def test_what_an_untouched_skin_has_wrong_is_named(skin: dict[str, object], item: str, verdict: str, said: str) -> None:
    found = finding(examine(touches=False, **skin), item)
    assert found.verdict == verdict
    assert said in found.value
    assert found.remedy


@pytest.mark.long
def test_a_clock_that_a_busy_computer_cannot_judge_is_no_fault_of_the_firmware() -> None:
    def clock(step: float, held: float = 0.0) -> Finding:
        seen = SensorStatistics()
        for time, frame in VirtualSkin(parse_scene(TEXT).sensors[0].sensor, duration=3.0, model="ladder").frames():
            seen.frames.append(frame)
            seen.times.append(max(time + step * (time > 1.5), 3.0 if time > 3.0 - held else 0.0))
        (found,) = (one for one in _timing("skin", seen, 0.0, 0.05, 200.0) if one.item == "skin, clock")
        return found

    assert clock(0.0).verdict == "ok"
    assert clock(0.08).verdict == "ok"  # a step is no clock
    assert clock(0.0, 2.4).verdict == "warning"
    assert "not told: this computer held frames up, 2" in clock(0.0, 2.4).value


@cache
def untouched() -> tuple[Sensor, list[tuple[float, Frame]]]:
    sensor = parse_scene(TEXT).sensors[0].sensor
    return sensor, list(VirtualSkin(sensor, duration=0.3, rate_hz=200.0, model="ladder").frames())


def altered(channel: str, change: Callable[[int, int], float]) -> dict[str, str]:
    """Verdicts of a right skin, one of whose readings a function of count and number of the frame changes."""
    (sensor, frames), seen = untouched(), SensorStatistics()
    for number, (time, frame) in enumerate(frames):
        seen.frames.append(frame._replace(**{channel: round(change(getattr(frame, channel), number))}))
        seen.times.append(time)
    return {one.item.removeprefix("skin, "): one.verdict for one in examine_sensor(sensor, seen, 0.0, 0.05, 200.0)}


@pytest.mark.parametrize(
    ("item", "channel", "change", "verdict"),
    [
        ("radial current", "radial_current", lambda count, _: 1.2 * count, "ok"),
        ("radial current", "radial_current", lambda count, _: 1.3 * count, "warning"),
        ("angular current", "angular_current", lambda count, _: count / 1.9, "warning"),
        ("angular current", "angular_current", lambda count, _: count / 2.1, "bad"),
        ("supply", "touch_supply", lambda count, _: 0.91 * count, "ok"),
        ("supply", "touch_supply", lambda count, _: 0.89 * count, "bad"),
        ("noise", "radial_current", lambda count, number: count + 7 * (-1) ** number, "ok"),
        ("noise", "radial_current", lambda count, number: count + 9 * (-1) ** number, "warning"),
    ],
)
def test_what_is_measured_has_its_limits(
    item: str, channel: str, change: Callable[[int, int], float], verdict: str
) -> None:
    """Currents within 1.25 times the design's, refused beyond twice; a supply to 10 %; noise of 8 counts."""
    assert altered(channel, change)[item] == verdict


@pytest.mark.parametrize("ratio", [1.0, 1.2, 0.8])
def test_a_clock_is_blamed_where_it_is_wrong_however_often_a_busy_computer_is_late(ratio: float) -> None:
    """Each tenth to third of a second the frames are late by another time up to 30 ms, none of them read at once."""
    imperfections = Imperfections(clock_ratio=ratio)
    skin = VirtualSkin(parse_scene(TEXT).sensors[0].sensor, duration=2.0, rate_hz=200.0, imperfections=imperfections)
    frames, verdicts = list(skin.frames()), set()
    for number in range(80):
        seen, jitter, late, until = SensorStatistics(), random.Random(number), 0.0, 0.0
        for time, frame in frames:
            if time >= until:
                late, until = jitter.uniform(0.0, 0.03), time + jitter.uniform(0.1, 0.33)
            seen.frames.append(frame)
            seen.times.append(max(time + late, seen.times[-1] + 1e-4 if seen.times else 0.0))
        verdicts.update(one.verdict for one in _timing("skin", seen, 0.0, 0.05, 200.0) if one.item == "skin, clock")
    assert ("bad" in verdicts) == (ratio != 1.0)


def test_a_low_rate_for_which_the_scene_is_made_is_a_warning() -> None:
    patient = TEXT + "[monitoring]\nskin_silence_ms = 100\n"
    assert finding(examine(patient, touches=False, rate_hz=41.0), "skin, rate").verdict == "warning"
    assert finding(examine(patient, touches=False, rate_hz=38.0), "skin, rate").verdict == "bad"
    usual = finding(
        examine(touches=False, rate_hz=199.0), "skin, rate"
    )  # of a board whose clock is half a per cent off
    assert usual.verdict == "ok"


def test_the_rate_that_the_scene_gives_a_virtual_skin_is_the_one_that_is_wanted() -> None:
    virtual = TEXT.replace('kind = "serial"\nport = "/dev/nothing"\nbaud = 115200', 'kind = "virtual"\nrate_hz = 100')
    found = finding(examine(virtual, touches=False, rate_hz=100.0), "skin, rate")
    assert (found.verdict, found.rule) == ("ok", "100 to 1000")
    assert finding(examine(virtual, touches=False, rate_hz=90.0), "skin, rate").verdict == "warning"


@pytest.mark.long
def test_frames_of_touches_are_held_against_themselves() -> None:
    assert finding(right(), "skin, chi-squared").verdict == "ok"
    off = finding(examine(TEXT.replace("wrap_deg = 330", "wrap_deg = 330\npulldown_ohm = 11000")), "skin, chi-squared")
    assert off.verdict == "bad"
    assert "measure pulldown_ohm" in off.remedy


def test_another_sheet_resistance_is_named_with_what_to_write() -> None:
    sensor = parse_scene(TEXT.replace("wrap_deg = 330", "wrap_deg = 330\nupper_sheet_ohm = 1400\n")).sensors[0].sensor
    parts = parse_scene(TEXT).sensors[0].sensor.electronics
    made = Sensor(sensor.frustum, electronics=parts, upper_sheet_ohms=1400.0, name="skin")
    found = finding(examine(touches=False, sensors=made), "skin, radial current")
    assert found.verdict == "warning"
    assert "write upper_sheet_ohm = 14" in found.remedy
    assert finding(examine(touches=False, wires="ACBD"), "skin, radial current").remedy == (
        "the wire of A or B is open, shorted to the supply, or exchanged with one of the other sheet"
    )


@pytest.mark.parametrize(
    ("short", "said"),
    [
        (("A", "B"), "full scale: too much drive current in the radial phase: A and B are shorted"),
        (("C", "D"), "full scale: too much drive current in the angular phase: C and D are shorted"),
        (("B", "ground"), "full scale: A or B joined to ground"),
        (("A", "ground"), "full scale: A joined to ground"),
        (("D", "supply"), "D joined to the supply"),
        *(((upper, lower), f"a short: {upper} joined with {lower}") for upper in "AB" for lower in "CD"),
    ],
)
def test_a_short_from_the_start_is_named_and_nothing_is_made_of_its_readings(short: tuple[str, str], said: str) -> None:
    doctor = examine(faults=FaultInjection(wiring=WiringFaults(shorts=(short,)), wiring_after=0))
    assert said in finding(doctor, "skin, short").value
    assert said in finding(doctor, "frames").value
    assert finding(doctor, "skin, wires").verdict == "not tried"
    told = " ".join(one.text for one in doctor.findings)
    assert "sheet_ohm" not in told
    assert "stuck_frames" not in told
    assert "without a current" not in told


@pytest.mark.parametrize(
    ("upper", "lower", "verdict", "said"),
    [
        (1.003, 1.0, "ok", ""),
        (1.015, 1.0, "warning", "the upper sheet, or its bond to A or B"),  # a fifth of an electrode has peeled off
        (1.0, 0.97, "warning", "the lower sheet, or its bond to C or D"),
        (1.03, 1.03, "ok", ""),  # another day's warmth
        (1.08, 1.08, "warning", "the gain of the current, or both sheets"),
    ],
)
def test_a_sheet_that_is_not_what_it_was_at_the_calibration_is_named(
    upper: float, lower: float, verdict: str, said: str
) -> None:
    text = TEXT.replace("wrap_deg = 330", "wrap_deg = 330\nmap_sheet_ohm = [980, 1010]")
    plain = parse_scene(TEXT).sensors[0].sensor
    made = replace(plain, upper_sheet_ohms=980.0 * upper, lower_sheet_ohms=1010.0 * lower)
    found = finding(examine(text, touches=False, sensors=made), "skin, sheets")
    assert (found.verdict, said in found.remedy) == (verdict, True)


def test_a_skin_with_another_number_is_named() -> None:
    doctor = examine(TEXT.replace('name = "skin"', 'name = "skin"\nid = 3'))
    assert finding(doctor, "sensor 0/3").value == "it sends nothing; there are 0/0 (device/sensor)"
    assert finding(doctor, "sensor 0/0").verdict == "warning"
    assert finding(doctor, "skin, wires").verdict == "not tried"


def test_a_stream_that_is_no_frame_is_named_by_the_diagnosis() -> None:
    class Text(MemorySource):
        def read(self, timeout: float) -> bytes:
            return super().read(timeout) and b"sensor 1: 1023 1020\r\n"

    source = Text(VirtualSkin(parse_scene(TEXT).sensors[0].sensor, model="ladder"))
    doctor = Doctor(parse_scene(TEXT), clock=source.clock)
    with source:
        doctor.examine_skin(source, {"baud": 115200})
    found = finding(doctor, "frames")
    assert found.verdict == "bad"
    assert "sensor 1: 1023" in found.value
    assert "binary" in found.remedy


def test_touches_that_nobody_makes_are_not_tried() -> None:
    assert finding(examine(touches=False), "skin, wires").verdict == "not tried"


def test_the_four_places_are_on_the_sensor_near_their_electrodes() -> None:
    sensor = parse_scene(TEXT).sensors[0].sensor
    places = touch_places(sensor)
    assert places["B"][0] < 0.2 * sensor.frustum.slant < 0.8 * sensor.frustum.slant < places["A"][0]
    assert places["D"][1] < 0.2 * sensor.frustum.wrap < 0.8 * sensor.frustum.wrap < places["C"][1]
