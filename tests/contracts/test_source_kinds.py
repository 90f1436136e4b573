"""A further kind of source: one class and one row, and a scene names it, opens it and is guarded through it."""

import ast
import math

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.core.errors import SceneError, SensorError, SkinConnectionError
from coneskin.core.keys import Key
from coneskin.core.recording.block import decode_blocks
from coneskin.geometry.frustum import Frustum
from coneskin.robot.guard.loop import GuardLoop, GuardPorts
from coneskin.robot.guard.signals.journal import BlockKind, decode_event
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.scene.summary import summarize
from coneskin.skin.detection.events import TouchBegan
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.kinds import SOURCE_KINDS, SourceKind, open_source
from coneskin.skin.sources.source import Source
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from tests.support.paths import ROOT

FRUSTUM = Frustum(0.054, 0.054, 0.434)
TOUCH = ScriptedTouch(0.05, 0.2, 0.2, 1.0)
SCENE = """
[[link]]
name = "forearm"

[[link.sensor]]
radius1_mm = 54
radius2_mm = 54
height_mm = 434

[source]
kind = "i2c"
bus = 1
poll_ms = 2
"""


class PolledBus(Source):
    """A sensor that is asked for its newest frames, as on an I2C bus; the frames are those of a virtual skin."""

    def __init__(self, bus: int, address: int, poll: float) -> None:
        self.name = f"i2c bus {bus}, address {address:#x}"
        self.poll = poll
        self._packets = VirtualSkin(Sensor(FRUSTUM), [TOUCH], duration=0.3, seed=5).packets()

    def open(self) -> None:
        """Do nothing: there is no bus."""

    def close(self) -> None:
        """Do nothing: there is no bus."""

    def fileno(self) -> int | None:
        """Return None: a bus that is asked has nothing to wait on."""
        return None

    def read(self, timeout: float) -> bytes:
        """Return the next packet."""
        for _, packet in self._packets:
            return packet
        raise SkinConnectionError(f"{self.name} is gone")


@pytest.fixture
def i2c(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one row."""
    keys = (
        Key("bus", int, low=0, high=15, meaning="the number N of /dev/i2c-N"),
        Key("address", int, 0x40, low=3, high=119),
        Key("poll_ms", float, 1e-3, low=1.0, high=50.0),
    )
    monkeypatch.setitem(SOURCE_KINDS, "i2c", SourceKind(f"{__name__}:PolledBus", keys))


def test_a_scene_names_it_and_its_bytes_are_decoded(i2c: None) -> None:
    scene = parse_scene(SCENE)
    assert scene.source is not None
    assert dict(scene.source.settings) == {"bus": 1, "address": 0x40, "poll": 0.002}
    assert summarize(scene)["source"] == "i2c 1"
    began = []
    stream = TouchStream([item.sensor for item in scene.sensors])
    with open_source(scene.source.kind, scene.source.settings) as source:
        assert source.name == "i2c bus 1, address 0x40"
        for number in range(150):
            began += [e for e in stream.feed(source.read(0.0), 1e-3 * number) if isinstance(e, TouchBegan)]
    (touch,) = began
    assert math.hypot(touch.u - TOUCH.u, FRUSTUM.radius1 * (touch.phi - TOUCH.phi)) < 0.01


def test_the_guard_reports_a_touch_that_comes_through_it(i2c: None) -> None:
    scene = parse_scene(SCENE)
    assert scene.source is not None
    ours, theirs = pair()
    supervisor, session = Channel(ours), Channel(theirs)
    with open_source(scene.source.kind, scene.source.settings) as source:
        now = 0.0
        loop = GuardLoop(build_core(scene), GuardPorts(supervisor, source), lambda: now)
        loop._open()
        names = []
        for number in range(200):
            now = 1e-3 * number  # [s], one packet a step
            loop.poll(0.0)
            for message in session.receive():
                names += [decode_event(b).name for b in decode_blocks(message) if b.kind == BlockKind.EVENT]
        loop._close()
    supervisor.close()
    session.close()
    assert "contact" in names


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bus = 1", "", "source.bus is missing: the number N of /dev/i2c-N"),
        ("bus = 1", "bus = 16", "source.bus must be a whole number from 0 to 15, got 16"),
        ("bus = 1", 'bus = 1\nport = "x"', "source.port means nothing to kind i2c: remove it"),
        ("poll_ms = 2", "poll_s = 2", "source: unknown key poll_s; did you mean poll_ms?"),
        ('"i2c"', '"spi"', "source.kind must be one of serial, virtual, i2c, got 'spi'"),
    ],
)
def test_its_keys_are_checked_by_its_row(i2c: None, old: str, new: str, message: str) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(SCENE.replace(old, new))
    assert message in str(error.value)


def test_without_its_row_there_is_no_such_kind() -> None:
    with pytest.raises(SceneError, match=r"source\.kind must be one of serial, virtual, got 'i2c'"):
        parse_scene(SCENE)
    with pytest.raises(SensorError, match="kind of a source must be one of serial, virtual, got 'i2c'"):
        open_source("i2c", {})


def test_every_row_opens_a_source_of_its_own_keys() -> None:
    for kind, row in SOURCE_KINDS.items():
        settings = {key.name: "loop://" if key.default is ... else key.default for key in row.keys}
        assert isinstance(open_source(kind, settings, "loop://"), Source)


@pytest.mark.long
def test_only_the_table_names_a_class_of_source() -> None:
    product = [path for folder in ("skin", "robot", "src/coneskin") for path in (ROOT / folder).rglob("*.py")]
    named = {
        path.name
        for path in product
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and any(alias.name == "SerialPort" for alias in node.names)
    }
    assert named <= {"__init__.py"}  # the public face, which offers it to programs
