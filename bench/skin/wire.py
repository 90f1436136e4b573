"""What a frame costs: encode, decode, read, detect; and what noise costs.

    python -m bench wire

Each figure is for one frame, in microseconds, as the clock shows it around a single call (its own cost is in the line
"the clock itself"): median, 99th and 99.9th percentile. The numbers of one run can be compared, those of two machines
not; the last column mostly shows what else the machine was doing.
"""

import gc
import random
import time
from collections.abc import Callable

from bench.report import head
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.memory_source import MemorySource
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, FrameDecoder, encode, frame_at

SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))
FRAME_COUNT = 20_000


def main() -> None:
    print(head())
    quiet = [data for _, data in VirtualSkin(SENSOR, duration=FRAME_COUNT / 1000).packets()]
    held = [
        data
        for _, data in VirtualSkin(SENSOR, [ScriptedTouch(0, 1e9, 0.2, 1.0)], duration=FRAME_COUNT / 1000).packets()
    ]
    frames = [frame for data in quiet if (frame := frame_at(data))]
    held_frames = [frame for data in held if (frame := frame_at(data))]
    touched = held_frames[100:]
    halves = [half for data in quiet for half in (data[:17], data[17:])]
    rng = random.Random(0)
    noise = [rng.randbytes(FRAME_LENGTH) for _ in range(FRAME_COUNT)]

    gc.collect()
    gc.freeze()
    gc.disable()
    print(f"{'us per frame':44}{'median':>9}{'p99':>9}{'p99.9':>9}")
    row("the clock itself", lambda _: None, frames)
    row("encode", encode, frames)
    row("decode, aligned frame", FrameDecoder().feed, quiet)
    row("decode, frame in two pieces (per piece)", FrameDecoder().feed, halves)
    row("decode, 36 bytes of noise", FrameDecoder().feed, noise)
    row("read, untouched", lambda frame: read(SENSOR, frame), frames)
    row("read, touched (place included)", lambda frame: read(SENSOR, frame), touched)
    row("detect (read included), untouched", timed(Detector(SENSOR)), frames)
    row("detect, touched", timed(Detector(SENSOR)), held_frames)
    row("bytes -> events, untouched", timed(TouchStream([SENSOR])), quiet)
    row("bytes -> events, touched", timed(TouchStream([SENSOR])), held)

    joined = b"".join(quiet)
    start = time.perf_counter()
    found = len(FrameDecoder().feed(joined))
    span = time.perf_counter() - start
    print(f"decode in one piece: {span / found * 1e6:.2f} us per frame, {found / span / 1e3:.0f} k frames/s")
    start = time.perf_counter()
    source, stream, seconds = MemorySource(VirtualSkin(SENSOR, duration=60.0)), TouchStream([SENSOR]), 59.0
    with source:
        while source.clock() < seconds:
            stream.feed(source.read(1.0), source.clock())
    span = time.perf_counter() - start
    print(f"virtual skin -> bytes -> events in memory: {seconds / span:.0f} times as fast as real time at 1 kHz")


def timed(stage: Detector | TouchStream) -> Callable[[object], object]:
    """Feed a stage with a clock of its own, 1 ms a frame."""
    now = [0.0]

    def feed(item: object) -> object:
        now[0] += 1e-3
        return stage.feed(item, now[0])  # type: ignore[arg-type]

    return feed


def row(name: str, call: Callable[..., object], items: list) -> None:
    clock = time.perf_counter_ns
    spans = []
    for item in items:
        start = clock()
        call(item)
        spans.append(clock() - start)
    spans.sort()
    figures = (spans[round((len(spans) - 1) * part)] / 1e3 for part in (0.5, 0.99, 0.999))
    print(f"{name:44.44}" + "".join(f"{figure:9.2f}" for figure in figures))
