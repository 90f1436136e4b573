"""Contract of touching: what scripted persons do to a virtual skin, what they are told, and what is decided of it.

``persons.json`` holds what the four former machines said and decided, checked by hand; times are of the source's clock.
"""

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from coneskin.commissioning import skin_watch
from coneskin.commissioning.acceptance.commission import prepare
from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.calibration.touches import ForceSequence, SensorPresses, SensorTouches, TouchSequence
from coneskin.commissioning.examination.guided_touches import examine_touches, guided_touches
from coneskin.commissioning.examination.wires import examine_wires
from coneskin.commissioning.touching import REQUESTS, Mark, Notice
from coneskin.core.errors import ConeSkinError
from coneskin.scene.reader import parse_scene
from coneskin.skin.virtual.memory_source import MemorySource
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, FrameDecoder, Status, encode

GOLDEN = Path(__file__).with_name("persons.json")
SCENE = parse_scene(
    """\
[[link]]
name = "tube"
[[link.sensor]]
name = "one"
radius1_mm = 41
radius2_mm = 40
height_mm = 240
wrap_deg = 330
[[link.sensor]]
name = "two"
id = 1
radius1_mm = 40
radius2_mm = 40
height_mm = 100
wrap_deg = 330
xyz_mm = [0, 0, 300]
[source]
kind = "serial"
port = "/dev/nothing"
baud = 115200
"""
)
ONE, TWO = (item.sensor for item in SCENE.sensors)
REACTION = 0.25  # s from a request to the touch
BEFORE_AGAIN = 1.0  # s after a touch that has led to nothing
LENGTHS = {"short": 0.12, "silence": 0.0, "refuse": 0.0, "both": 4.0, "drift": 4.0, "light": 4.0, "long": 6.0}  # s

#: person -> what is done at one request after the other; then all touches are good
PERSONS: dict[str, tuple[str, ...]] = {
    "good": (),
    "early release": ("short", "good", "short"),
    "wrong place": ("wrong", "good", "wrong", "wrong"),
    "wrong place once": ("good", "wrong"),
    "two hands": ("both", "good", "both"),
    "other sheet": ("other", "other"),
    "drifting hold": ("drift", "drift", "good"),
    "too lightly": ("light", "good"),
    "silence": ("silence", "good", "silence"),
    "never lets go": ("long", "long"),
    "repeated": ("good", "twice", "good", "twice"),
    "out of reach": ("refuse", "good", "refuse"),
    "out of all reach": ("refuse",) * 40,
    "fault": ("good", "fault"),
}
MACHINES = ("acceptance", "calibration", "forces")


class Line(MemorySource):
    """The skin, the person at it, and their common clock; a fault goes into each frame from its time on."""

    def __init__(self, wires: str = "ABCD") -> None:
        self.skin = VirtualSkin((ONE, TWO), rate_hz=125.0, model="ladder", seed=3, wires=wires)
        super().__init__(self.skin)
        self.faulty = False
        self._decoder = FrameDecoder()

    def read(self, timeout: float) -> bytes:
        data = super().read(timeout)
        if not self.faulty:
            return data
        frames = self._decoder.feed(data)
        return b"".join(encode(frame._replace(status=frame.status | Status.ADC)) for frame in frames)


class Person:
    """A person who does one thing of the script after the other."""

    def __init__(self, line: Line, script: tuple[str, ...], hold: float) -> None:
        self.line, self.script, self.hold = line, iter(script), hold
        self.refused = False
        self._keeps = False
        self._due: float | None = None
        self._asked: tuple[str, float, float, float] | None = None

    def ask(self, sensor: str, u: float, phi: float, force: float) -> None:
        """Take a request, and do what is next."""
        self._asked = sensor, u, phi, force
        self.act()

    def rest(self) -> None:
        """Take that the touch was read: let go."""
        if not self._keeps:
            self.line.skin.release(self.line.clock() + 0.05)
        self._due = None

    def poll(self) -> None:
        """Do the next thing where the last one has led to nothing."""
        if self._due is not None and self.line.clock() >= self._due:
            self.act()

    def act(self) -> None:
        assert self._asked is not None
        sensor, u, phi, force = self._asked
        what, start = next(self.script, "good"), self.line.clock() + REACTION
        self._keeps = what == "long"
        length = LENGTHS.get(what, self.hold)
        other = "two" if sensor == "one" else "one"
        touched = [(sensor, u, phi)]
        if what == "wrong":
            touched = [(sensor, u + (0.06 if u < 0.1 else -0.06), phi)]
        elif what == "other":
            touched = [(other, 0.05, 1.0)]
        elif what == "both":
            touched = [(sensor, u, phi), (other, 0.05, 1.0)]
        slide = (0.12 if u < 0.1 else -0.12) if what == "drift" else 0.0
        for name, at, around in touched if length else ():
            newton = 0.55 if what == "light" else force
            self.line.skin.touch(
                ScriptedTouch(start, start + length, at, around, force=newton, sensor=name, slide_u=slide)
            )
        if what == "twice":
            again = start + length + 0.3
            self.line.skin.touch(ScriptedTouch(again, again + 0.2, u, phi, force=force, sensor=sensor))
        self.refused = what == "refuse"
        self.line.faulty |= what == "fault"
        self._due = start + max(length, 3.0 * (what == "silence")) + BEFORE_AGAIN


def carry_out(machine: str, who: str, patch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Let a person touch what a machine asks for; return what it said and decided."""
    line = Line()
    sensors: Any
    if machine == "acceptance":
        judge: Any = prepare(SCENE, None)
        sensors, hold = judge.sensors, 1.0
    elif machine == "calibration":
        sensors = [SensorTouches(one, _calibration_marks(one, 4 + 5 * (one is ONE))) for one in (ONE, TWO)]
        judge, hold = TouchSequence(sensors, 0.3e-3), 1.6
    else:
        sensors = [SensorPresses(one, _calibration_marks(one, 4)[:2]) for one in (ONE, TWO)]
        judge, hold = ForceSequence(sensors, (8.0, 2.0)), 3.0
    person = Person(line, PERSONS[who], hold)
    said: list[Any] = []

    def tell(notice: Notice) -> None:
        said.append([round(line.clock(), 3), notice.kind, notice.text, dict(notice.details)])
        if notice.kind in REQUESTS:
            person.ask(judge.current.sensor.name, *judge.mark.place, judge.force)
        elif notice.kind in ("read", "passed", "failed") or "once more" in notice.text:
            person.rest()

    def refused() -> bool:
        person.poll()
        was, person.refused = person.refused, False
        return was

    patch.setattr(skin_watch, "open_source", lambda *_: line)
    patch.setattr(skin_watch, "check_touchable", lambda *_: None)
    patch.setattr(time, "monotonic", line.clock)
    result: dict[str, Any] = {"said": said, "error": ""}
    try:
        session = skin_watch.TouchSession(SCENE, tell, refused=refused)
        with session.watch() as watch:
            session.carry_out(judge, watch)
    except ConeSkinError as exc:
        result["error"] = str(exc)
    result |= {"over": judge.over, "incomplete": judge.incomplete, "decided": decided(machine, judge, sensors)}
    return result


def decided(machine: str, judge: Any, sensors: Any) -> Any:
    """What has come of it, as JSON has it."""
    if machine == "acceptance":
        marks = [
            [
                list(result.__dict__.values())
                if hasattr(result, "__dict__")
                else [getattr(result, name) for name in result.__slots__]
                for result in item.results
            ]
            for item in sensors
        ]
        return [judge.passed, judge.cause, marks]
    if machine == "calibration":
        return [[item.touches, sorted(item.repeated), item.valid] for item in sensors]
    return [item.presses for item in sensors]


def examine(who: str, wires: str) -> dict[str, Any]:
    """The same for the guided touches of the doctor."""
    line = Line(wires)
    person, kept, said = Person(line, PERSONS[who], 1.5), list[Frame](), list[Any]()

    def tell(notice: Notice, mark: Mark | None) -> None:
        said.append([round(line.clock(), 3), notice.kind, notice.text])
        if mark is not None:
            person.ask("one", *mark.place, 5.0)
        else:
            person.rest()

    def keep(frame: Frame) -> None:
        kept.append(frame)
        person.poll()

    with line:
        read = guided_touches(line, ONE, tell, 10.0, line.clock, keep)
        result: dict[str, Any] = {"said": said, "kept": len(kept), "read": read}
        if read is not None:
            finding, patch = examine_wires(ONE, read)
            result |= {"finding": asdict(finding), "patch": patch and list(patch)}
            result["agrees"] = asdict(examine_touches(ONE, kept[:40], kept[40:], 8e-3))
    return result


#: machine -> persons who meet something of its own, as all 51 pairs did before; the first of each is always run
CASES = {
    "acceptance": (
        "wrong place",
        "early release",
        "two hands",
        "other sheet",
        "too lightly",
        "out of all reach",
        "fault",
    ),
    "calibration": ("wrong place once", "early release", "two hands", "drifting hold", "never lets go", "out of reach"),
    "forces": ("early release", "two hands", "out of reach", "fault"),
    "doctor": ("repeated", "silence", "drifting hold", "wires BACD", "wires ACBD"),
}


def carry_out_case(machine: str, who: str, patch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what a machine said to a person and decided, as JSON has it."""
    if machine != "doctor":
        found = carry_out(machine, who, patch)
    else:
        wires = who.removeprefix("wires ") if who.startswith("wires") else "ABCD"
        found = examine("good" if who.startswith("wires") else who, wires)
    return dict(json.loads(json.dumps(found)))


@pytest.mark.parametrize(
    ("machine", "who"),
    [
        pytest.param(machine, who, marks=[pytest.mark.long] if number else [])
        for machine, persons in CASES.items()
        for number, who in enumerate(persons)
    ],
)
@pytest.mark.long
def test_each_person_is_told_and_judged_as_before(machine: str, who: str, monkeypatch: pytest.MonkeyPatch) -> None:
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    assert carry_out_case(machine, who, monkeypatch) == golden[f"{machine}, {who}"]
