"""Budget of the way of a stop: files and moves between them, from the bytes of a frame to the command.

The way is short so that a person can read it at one sitting, and because what stands on it delays the stop.
"""

import gc
import os
import sys
from types import FrameType

import pytest

from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.guard.signals.journal import INPUTS, BlockKind, EventName, GuardEvent, Output
from coneskin.runs.replay.run import read_run
from coneskin.scene.build import build_core
from tests.support.paths import COLLISION, ROOT

MAX_FILES = 12
MAX_MOVES = 25
PRODUCT = tuple(str(ROOT / folder) + os.sep for folder in ("src", "geometry", "skin", "robot"))
GENERATED = "<string>"  # the methods that dataclasses and named tuples generate
LATER = ("touch_place", "place_estimate", "seam_contact", "single_contact", "contact")  # what a stop does not wait for


class Walk:
    """Way of one input through the product's files, from the profiler's calls and returns."""

    def __init__(self) -> None:
        self.files: list[str] = []
        self._stack: list[str] = []

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        name = frame.f_code.co_filename
        path = name if name == GENERATED else os.path.realpath(name)
        if event not in ("call", "return") or not (path == GENERATED or path.startswith(PRODUCT)):
            return
        if event == "call":
            self._stack.append(path)
        elif self._stack:
            self._stack.pop()
        if self._stack and (not self.files or self.files[-1] != self._stack[-1]):
            self.files.append(self._stack[-1])


class Sink(list[Output]):
    """Outputs of a guard, and the way up to the first command that stops the arm."""

    def __init__(self, walk: Walk) -> None:
        super().__init__()
        self.walk = walk
        self.way: list[str] = []

    def append(self, output: Output, /) -> None:
        super().append(output)
        if isinstance(output, StopProgram) and not self.way:
            self.way = list(self.walk.files)


def stop_of_the_collision() -> Sink:
    """Outputs of the frame that stops the arm of the recorded collision."""
    run = read_run(COLLISION)
    core = build_core(run.scene(), run.place_sensors())
    before = sys.getprofile()
    stop = next(block.time for block in run.blocks if block.kind == BlockKind.EVENT and b'"stopping"' in block.payload)
    for block in run.blocks:
        if block.kind not in INPUTS:
            continue
        if block.time < stop:  # the event has the time of the frame that stops the arm
            core.feed(block, [])
            continue
        sink = Sink(Walk())
        gc.disable()  # what it would call belongs to other tests
        sys.setprofile(sink.walk)
        try:
            core.feed(block, sink)
        finally:
            sys.setprofile(before)
            gc.enable()
        if sink.way:
            return sink
    raise AssertionError("nothing has stopped the arm")


@pytest.mark.pure  # compiled calls are not seen by a profiler
def test_the_way_of_a_stop_keeps_its_budget() -> None:
    sink = stop_of_the_collision()
    way = sink.way[next(k for k, path in enumerate(sink.way) if path != GENERATED) :]  # before, another test's remains
    names = [os.path.basename(path).removesuffix(".py") for path in way]
    assert names[0] == "core"
    assert len(set(way)) <= MAX_FILES, " > ".join(names)
    assert len(way) <= MAX_MOVES, " > ".join(names)
    assert not set(names) & set(LATER)
    # the stop is the first that comes out; what explains it, and where the touch is, follows in the same call
    assert isinstance(sink[0], StopProgram)
    said = [output.name for output in sink if isinstance(output, GuardEvent)]
    assert said == [EventName.STOPPING, EventName.CONTACT]
