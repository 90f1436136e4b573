"""Several sources as one: frames that are cut on one port are not mixed with those of another."""

import random
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress

import pytest

from coneskin.core.errors import SensorError, SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import TouchBegan
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.source import Source, SourceGroup, _FrameBoundary
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, FrameDecoder

CUFF = Sensor(Frustum(0.054, 0.054, 0.434), 0, device_id=1, name="cuff")
SLEEVE = Sensor(Frustum(0.045, 0.045, 0.3), 0, device_id=2, name="sleeve")


class CutPieces(Source):
    """A source that hands on bytes in pieces of random length, and is gone at their end."""

    def __init__(self, name: str, data: bytes, seed: int) -> None:
        self.name = name
        self.data = data
        self._random = random.Random(f"pieces {seed}")
        self.opened = 0

    def open(self) -> None:
        self.opened += 1

    def close(self) -> None:
        self.opened = 0

    def fileno(self) -> int | None:
        return None

    def read(self, timeout: float) -> bytes:
        if not self.data:
            raise SkinConnectionError(f"{self.name} is gone")
        if self._random.random() < 0.2:
            raise SkinTimeout(f"{self.name}: no bytes")
        length = self._random.randint(1, 60)
        piece, self.data = self.data[:length], self.data[length:]
        return piece


def everything(group: SourceGroup) -> Iterator[bytes]:
    """What comes until one of the group is gone."""
    with suppress(SkinConnectionError):
        while True:
            yield group.read(0.5)


def sent(sensor: Sensor, seed: int) -> bytes:
    touch = ScriptedTouch(0.15, 0.28, u=0.2, phi=1.5, sensor=sensor.name)
    return b"".join(data for _, data in VirtualSkin(sensor, [touch], model="ladder", seed=seed, duration=0.3).packets())


def test_frames_that_are_cut_are_not_mixed_and_each_sensor_is_heard() -> None:
    a, b = CutPieces("a", sent(CUFF, 1), 1), CutPieces("b", sent(SLEEVE, 2), 2)
    group = SourceGroup([a, b])
    stream, decoder = TouchStream([CUFF, SLEEVE]), FrameDecoder()
    touched, frames = [], Counter[int]()
    with group:
        for data in everything(group):
            now = stream.decoder.frames / 2000
            frames.update(frame.device for frame in decoder.feed(data))
            touched += [e.sensor for e in stream.feed(data, now) if isinstance(e, TouchBegan)]
    assert (stream.decoder.bytes_skipped, stream.decoder.crc_errors) == (0, 0)
    assert sorted(touched) == ["cuff", "sleeve"]
    assert max(frames.values()) == 300
    assert (a.opened, b.opened) == (0, 0)


def test_what_one_port_loses_costs_the_other_nothing() -> None:
    whole = sent(CUFF, 1)
    a, b = CutPieces("a", whole[:1000] + whole[1017:], 3), CutPieces("b", sent(SLEEVE, 2), 4)
    decoder, frames = FrameDecoder(), list[Frame]()
    with SourceGroup([a, b]) as group:
        for data in everything(group):
            frames += decoder.feed(data)
    lossy, other = ([frame.sequence for frame in frames if frame.device == device] for device in (1, 2))
    assert len(lossy) <= 299
    assert len(other) > 250
    assert other == list(range(len(other)))


def test_the_boundary_hands_on_every_byte_in_its_order() -> None:
    data, cut, out = b"noise" + sent(CUFF, 5) + b"\xc5\x3a", _FrameBoundary(), b""
    for at in range(0, len(data), 7):
        out += cut.cut(data[at : at + 7])
    assert data.startswith(out)
    assert data[len(out) :] == b"\xc5\x3a"


def test_where_one_cannot_be_opened_none_stays_open() -> None:
    class Refusing(CutPieces):
        def open(self) -> None:
            raise SkinConnectionError("b: no such port")

    a = CutPieces("a", b"", 1)
    with pytest.raises(SkinConnectionError, match="b: no such port"), SourceGroup([a, Refusing("b", b"", 1)]):
        pass
    assert a.opened == 0


@pytest.mark.parametrize("names", [[], ["a"], ["a", "a"]])
def test_a_group_has_two_ports_or_more_and_none_twice(names: list[str]) -> None:
    with pytest.raises(SensorError, match="two or more sources with different ports"):
        SourceGroup([CutPieces(name, b"", 1) for name in names])
