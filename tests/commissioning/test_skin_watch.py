"""Skin watch of commissioning and calibration: a touch whose inputs contradict each other is told, not passed on."""

from types import SimpleNamespace
from typing import Any

import pytest

from coneskin.commissioning import skin_watch
from coneskin.commissioning.touching import Mark, Notice, TouchJudge
from coneskin.scene.reader import parse_scene
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FrameDecoder, encode
from tests.support.scenes import forearm_scene

SCENE = parse_scene(forearm_scene())
SENSOR = SCENE.sensors[0].sensor


class Line:
    """A source of frames of a touch off the middle, one every millisecond; an input of C has this gain."""

    def __init__(self, gain: float) -> None:
        skin = VirtualSkin([SENSOR], [ScriptedTouch(0.3, 9.0, 0.05, 1.0, force=5.0)], seed=1)
        self._packets, self._gain, self._decoder = skin.packets(), gain, FrameDecoder()
        self.time = 0.0

    def __enter__(self) -> "Line":
        return self

    def close(self) -> None:
        """Nothing is open."""

    def read(self, timeout: float) -> bytes:
        self.time += 1e-3
        (frame,) = self._decoder.feed(next(self._packets)[1])
        return encode(
            frame._replace(touch_c=round(self._gain * frame.touch_c), radial_c=round(self._gain * frame.radial_c))
        )


@pytest.mark.parametrize(("gain", "words"), [(1.0, ""), (0.93, "check their gains and wires")])
def test_inputs_that_contradict_each_other_are_told(gain: float, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(gain)
    monkeypatch.setattr(skin_watch.time, "monotonic", lambda: line.time)
    watch = skin_watch.SkinWatch(SCENE, line)  # type: ignore[arg-type]
    watch.await_ready()
    for _ in range(600):
        readings = watch.read(0.0)  # the procedure goes on: it names exchanged wires by the places
    assert readings[SENSOR.name] is not None
    assert watch.contradiction(SENSOR.name).endswith(words)
    assert bool(watch.contradiction(SENSOR.name)) == bool(words)


class _Once(TouchJudge[Any]):
    """A judge that is content with the first touch."""

    current: Any = SimpleNamespace(sensor=SENSOR)

    def ask(self) -> Notice:
        self.mark = Mark(0.05, 1.0, "there")
        return Notice("mark", "touch there")

    def hold(self, touch: Any) -> list[Notice]:
        self.over = True
        return []


def test_a_virtual_touch_that_was_not_read_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A computer that was held up for as long as the touch lasted read nothing of it; nobody else touches."""
    touches: list[float] = []
    clock = SimpleNamespace(time=0.0)

    def read(_: float) -> dict[str, Any]:
        clock.time += 0.01
        return {SENSOR.name: "touched" if len(touches) == 2 else None}

    monkeypatch.setattr(skin_watch.time, "monotonic", lambda: clock.time)
    session = skin_watch.TouchSession(SCENE, simulated=True)
    session._client = SimpleNamespace(touch=lambda *_: touches.append(clock.time))  # type: ignore[assignment]
    session.carry_out(_Once(), SimpleNamespace(read=read), 0.5)  # type: ignore[arg-type]
    assert len(touches) == 2
    assert touches[1] - touches[0] > 1.0, "not while the first one may still be on its way"
