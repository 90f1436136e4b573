"""Many quiet inputs at once leave a guard as they do one by one: each bit of its state, each event, each command."""

import math
import struct
from collections.abc import Callable, Iterator
from random import Random

import numpy as np
import pytest

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.quiet_inputs import take_inputs
from coneskin.robot.guard.signals.journal import INPUTS, BlockKind, Output
from coneskin.runs.replay.run import read_run
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.detection.quiet_frames import find_quiet_frames
from coneskin.skin.frame_batch import find_frames
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.wire import Frame, encode, frame_at
from tests.support.paths import COLLISION
from tests.support.sweep import sweep

from ...scene.scenes import FULL, SKIN_ONLY, inputs
from .guard_state import state_of

Blocks = list[Block]


pytestmark = pytest.mark.pure


def recorded(text: str, end: float = 1.2) -> tuple[Callable[[], GuardCore], Blocks]:
    scene = parse_scene(text, "scene.toml")
    touch = ScriptedTouch(0.9, 1.0, 0.07, math.pi / 2, sensor=scene.sensors[-1].sensor.name)
    return lambda: build_core(scene), list(inputs(scene, touch, end))


def collision() -> tuple[Callable[[], GuardCore], Blocks]:
    run = read_run(COLLISION)
    return lambda: build_core(run.scene(), run.place_sensors()), list(run.select(kinds=INPUTS))


def assert_the_same(build: Callable[[], GuardCore], blocks: Blocks, size: int) -> int:
    """Give the inputs to two guards, one of which takes them many at once; return how many it took one by one."""
    one, many = build(), build()
    said: tuple[list[Output], list[Output]] = [], []
    slow = []

    def take(block: Block) -> None:
        slow.append(block)
        many.feed(block, said[1])

    for at in range(0, len(blocks), size):
        for block in blocks[at : at + size]:
            one.feed(block, said[0])
        take_inputs(many, blocks[at : at + size], take)
        assert state_of(many) == state_of(one), at
    assert said[0] == said[1]
    return len(slow)


@pytest.mark.long
def test_a_collision_is_the_same_bit_by_bit() -> None:
    build, blocks = collision()
    assert assert_the_same(build, blocks, 500) < 0.55 * len(blocks)  # the rest is the guard at work


def test_most_of_a_quiet_run_is_not_taken_one_by_one() -> None:
    build, blocks = recorded(FULL, 0.9)
    assert len(build().stream.detectors) == 2
    active = [block for block in blocks if block.time < 1000.4]
    slow = assert_the_same(build, blocks, len(blocks)) - assert_the_same(build, active, len(active))
    assert slow < 0.05 * (len(blocks) - len(active))


def test_a_skin_without_an_arm_is_the_same() -> None:
    build, blocks = recorded(SKIN_ONLY)
    assert assert_the_same(build, blocks, 700) < 0.7 * len(blocks)


# ---- what goes wrong in a run, from 0.6 s on


def _frames(blocks: Blocks, change: Callable[[int, Frame], Frame]) -> Iterator[Block]:
    """Change the frames of one sensor, numbered from 0.6 s on."""
    number = 0
    for block in blocks:
        frame = frame_at(block.payload) if block.kind == BlockKind.SKIN and block.time > 1000.6 else None
        if frame is not None and frame.sensor == 1:
            block = block._replace(payload=encode(change(number, frame)) + block.payload[len(encode(frame)) :])
            number += 1
        yield block


def _one(at: int, **fields: int) -> Callable[[int, Frame], Frame]:
    return lambda number, frame: frame._replace(**fields) if number == at else frame


def _from(at: int, change: Callable[[Frame], Frame]) -> Callable[[int, Frame], Frame]:
    return lambda number, frame: change(frame) if number >= at else frame


def _without(blocks: Blocks, kind: BlockKind, since: float, until: float) -> Blocks:
    return [block for block in blocks if not (block.kind == kind and since < block.time - 1000.0 < until)]


def _cut_anew(blocks: Blocks) -> Iterator[Block]:
    """Hand the skin's bytes over in other pieces, with some bytes of noise in between."""
    random, rest = Random(5), b""
    for block in blocks:
        if block.kind != BlockKind.SKIN:
            yield block
            continue
        data = rest + block.payload + (b"noise" if random.random() < 0.003 else b"")
        keep = random.randrange(0, 50)
        data, rest = data[: len(data) - keep], data[len(data) - keep :]
        yield block._replace(payload=data)


def _arm(blocks: Blocks, at: int, change: Callable[[bytes], bytes]) -> Iterator[Block]:
    number = 0
    for block in blocks:
        if block.kind == BlockKind.ARM and block.time > 1000.6:
            number += 1
            if number >= at:
                block = block._replace(payload=change(block.payload))
        yield block


def _late(blocks: Blocks, since: float, until: float, by: float) -> Blocks:
    """Let what comes in a while come at its end, and some later."""
    return [
        block._replace(time=max(block.time, 1000.0 + until + by)) if since < block.time - 1000.0 < until else block
        for block in blocks
    ]


def _insert(blocks: Blocks, block: Block) -> Blocks:
    at = next(number for number, other in enumerate(blocks) if other.time > block.time)
    return [*blocks[:at], block, *blocks[at:]]


_STOPPED, _OFF = struct.pack(">iII", 7, 1 << 2, 2), struct.pack(">iII", 3, 1, 2)
_ENDED = struct.pack(">iII", 7, 1, 1)
MISHAPS: dict[str, Callable[[Blocks], Iterator[Block] | Blocks]] = {
    "cut anew, with noise": _cut_anew,
    "a touch of one frame": lambda b: _frames(b, _one(40, touch_c=900, touch_d=900)),
    "frames late": lambda b: _late(b, 0.65, 0.72, 0.0),
    "the program ends": lambda b: _arm(b, 30, lambda p: p[:-12] + _ENDED),
    "a bit flipped": lambda b: [
        x._replace(payload=x.payload[:20] + b"\xaa" + x.payload[21:]) if n % 211 == 0 and len(x.payload) == 36 else x
        for n, x in enumerate(b)
    ],
    "frames missing": lambda b: _without(b, BlockKind.SKIN, 0.7, 0.702),
    "skin silent": lambda b: _without(b, BlockKind.SKIN, 0.6, 0.85),
    "arm silent": lambda b: _without(b, BlockKind.ARM, 0.6, 0.85),
    "program silent": lambda b: _without(b, BlockKind.PROGRAM, 0.6, 2.0),
    "driver silent": lambda b: _without(b, BlockKind.DRIVER, 0.6, 2.0),
    "all held up": lambda b: _late(b, 0.65, 0.75, 0.003),
    "a frame twice": lambda b: [y for n, x in enumerate(b) for y in ([x, x] if n == 1200 else [x])],
    "restarted": lambda b: _frames(b, _one(40, status=0x20)),
    "device fault": lambda b: _frames(b, _one(40, status=0x02)),
    "clock jumps": lambda b: _frames(b, _from(40, lambda f: f._replace(clock_us=f.clock_us + 9000))),
    "open wire": lambda b: _frames(b, _from(40, lambda f: f._replace(radial_current=3))),
    "current jumps": lambda b: _frames(b, _from(40, lambda f: f._replace(radial_current=f.radial_current * 21 // 20))),
    "guides jump": lambda b: _frames(b, _from(40, lambda f: f._replace(radial_c=200, radial_d=200))),
    "leak": lambda b: _frames(b, _from(40, lambda f: f._replace(touch_c=f.touch_c + 9, touch_d=f.touch_d + 9))),
    "supply out of range": lambda b: _frames(b, _one(40, touch_supply=9, radial_supply=9, angular_supply=9)),
    "protective stop": lambda b: _arm(b, 30, lambda p: p[:-12] + _STOPPED),
    "power off": lambda b: _arm(b, 30, lambda p: p[:-12] + _OFF),
    "unreadable state": lambda b: _arm(b, 30, lambda p: p[:-1]),
    "state repeats itself": lambda b: _arm(b, 30, lambda p, kept=[]: kept.append(p) or kept[0]),
    "driver's error": lambda b: _insert(b, Block(BlockKind.DRIVER, 1000.7, StatusReport("error", "it hangs").encode())),
    "driver's remark": lambda b: _insert(b, Block(BlockKind.DRIVER, 1000.7, StatusReport("remark", "slow").encode())),
    "source lost": lambda b: _insert(b, Block(BlockKind.LOST, 1000.7, b"source\nunplugged")),
    "reset for nothing": lambda b: _insert(b, Block(BlockKind.RESET, 1000.7, b"1 1")),
    "suspended": lambda b: _insert(b, Block(BlockKind.SUSPENDED, 1000.7, b"2.5")),
    "skin open again": lambda b: _insert(b, Block(BlockKind.REOPENED, 1000.7, b"skin")),
    "unknown sensor": lambda b: _frames(b, _one(40, sensor=9)),
    "times out of order": lambda b: [*b[:1200], b[1300], *b[1200:]],
}


@pytest.mark.parametrize("mishap", sweep(MISHAPS, short=4))
def test_whatever_goes_wrong_is_the_same_bit_by_bit(mishap: str) -> None:
    build, blocks = recorded(FULL.replace("settle_ms = 50", "settle_ms = 50\nstuck_frames = 300"), 0.95)
    changed = list(MISHAPS[mishap](blocks))
    assert changed != blocks
    assert_the_same(build, changed, 400)


def test_values_that_stand_still_are_seen_in_the_same_frame() -> None:
    build, blocks = recorded(FULL.replace("settle_ms = 50", "settle_ms = 50\nstuck_frames = 90"), 0.95)
    stuck = list(_frames(blocks, _from(20, lambda frame: frame._replace(angular_current=500))))
    assert_the_same(build, stuck, 333)
    assert_the_same(build, stuck, len(stuck))


def test_a_plain_frame_is_quiet_to_the_live_reading_whatever_its_bytes_are() -> None:
    """And most frames of an untouched sensor are plain: the search is for both sides of each limit."""
    run, random = read_run(COLLISION), Random(11)
    sensor: Sensor = run.scene().sensors[0].sensor
    first = next(frame for block in run.select(kinds=frozenset({BlockKind.SKIN})) if (frame := frame_at(block.payload)))
    fields = [name for name in Frame._fields[6:18] if not (name.endswith("_supply") and first.length == 36)]
    frames = []
    for _ in range(4000):
        chosen = random.sample(fields, random.choice((1, 1, 2, 4)))
        width = 10.0 ** random.uniform(0.0, 3.0)
        values = {name: getattr(first, name) + round(random.gauss(0.0, width)) for name in chosen}
        values = {name: min(max(value, 0), 4095) for name, value in values.items()}
        if first.length == 36 and "touch_supply" in values:
            values |= dict.fromkeys(("radial_supply", "angular_supply"), values["touch_supply"])
        frames.append(first._replace(**values))
    batch = find_frames(b"".join(map(encode, frames)))
    plain = find_quiet_frames(sensor, batch, np.zeros(len(frames))).plain.tolist()
    for frame, quiet in zip(frames, plain, strict=True):
        reading = read(sensor, frame)
        if quiet:
            assert reading.fault is None, frame
            assert reading.level < sensor.thresholds.release_level, frame
    assert 0.2 < sum(plain) / len(plain) < 0.9
