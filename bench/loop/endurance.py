"""Endurance of the guard's core: a day's worth of frames as fast as it goes, looking for leaks and missed touches.

    python -m bench endurance [--hours 24] [--touch-every-s 60] [--json]

Every frame goes through the core by itself, as it would live: found in the bytes, checked, decoded, judged; every 2 ms
a state of the controller follows, and both are encoded for the recorder. Sequence number and device clock run on
through all their overflows (65.5 s, 71.6 min). The skin is touched once in a while; the arm then brakes, latches and is
reset. As in the live loop, the garbage collector is off.

The content of the frames is made once by the virtual skin (noise, touches at any phase of a frame) and used again with
new numbers and checksum. What it does not show: sockets, the disk, ur_rtde (bench `faults`, bench `reaction`).
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import random
import resource
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench.report import head
from coneskin.core.recording.block import Block, encode_block
from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.sim.mock_arm import CompanionProcesses
from coneskin.robot.ur.rtde_codec import STATE_RECIPE
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, encode
from tests.support.scenes import forearm_scene

RATE_HZ = 1000
QUIET, SCRIPTS, TOUCHED = 5000, 50, 150  # frames of each
SPEED, DECELERATION = 1.0, 10.0  # of the arm, rad/s and rad/s2
MAX_GROWTH = 1 << 20  # bytes of resident memory after the first report that still count as none


def contents(sensor: Sensor, seed: int) -> tuple[list[tuple[int, ...]], list[list[tuple[int, ...]]]]:
    """Return the contents of frames without a touch, and during some touches."""
    rng = random.Random(seed)
    quiet = [tuple(frame)[6:] for _, frame in VirtualSkin(sensor, seed=seed, duration=QUIET / RATE_HZ).frames()]
    scripts = []
    for number in range(SCRIPTS):
        touch = ScriptedTouch(
            0.005 + rng.random() / RATE_HZ,
            0.1,
            rng.uniform(0.02, 0.24),
            rng.uniform(0.0, 6.2),
            force=rng.uniform(5, 20),
        )
        skin = VirtualSkin(sensor, [touch], seed=seed + number, duration=TOUCHED / RATE_HZ)
        scripts.append([tuple(frame)[6:] for _, frame in skin.frames()])
    return quiet, scripts


class Day:
    """Feeds the core, and does what an arm would."""

    def __init__(self, seed: int, touch_every: float) -> None:
        scene = parse_scene(forearm_scene())
        self.core = build_core(scene)
        self._quiet, self._scripts = contents(scene.sensors[0].sensor, seed)
        self._every = max(2 * TOUCHED, round(touch_every * RATE_HZ))
        self._out: list[Any] = []
        self._companions = CompanionProcesses()
        self._speed = 0.0
        self._braking = False
        self._q = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
        self.frames = self.touches = self.stops = self.misnamed = self.recorded = 0
        self.trouble: list[str] = []

    def run(self, frames: int) -> None:
        """So many more frames, each by itself."""
        take, out, quiet, every = self.core.feed, self._out, self._quiet, self._every
        for number in range(self.frames, self.frames + frames):
            since = number % every - (every - TOUCHED)
            if since < 0:
                fields = quiet[number % QUIET]
            else:
                fields = self._scripts[number // every % SCRIPTS][since]
                self.touches += since == 0
            now = 1.0 + number / RATE_HZ
            head = (1, 0, 0, 0, number & 0xFFFF, 1000 * number & 0xFFFFFFFF)
            block = Block(BlockKind.SKIN, now, encode(Frame(*head, *fields)))
            take(block, out)
            self.recorded += len(encode_block(block))
            if number % 2 == 0:
                self._arm(now)
            for block in self._companions.blocks(now):
                take(block, out)
            if out:
                self._serve()
            if number % 50 == 49:
                self._person(now)
        self.frames += frames

    def _arm(self, now: float) -> None:
        """Feed a state of the arm, which moves while the guard is active."""
        if self._braking:
            self._speed = max(0.0, self._speed - 0.002 * DECELERATION)
        elif self.core.phase is Phase.ACTIVE:
            self._speed = SPEED
        self._q[0] = (self._q[0] + 0.002 * self._speed + 3.0) % 6.0 - 3.0
        state = (now, tuple(self._q), (self._speed, 0.0, 0.0, 0.0, 0.0, 0.0), 7, 1, 2, (0.0,) * 6, (0.0,) * 6)
        block = Block(BlockKind.ARM, now, STATE_RECIPE.pack(state))
        self.core.feed(block, self._out)
        self.recorded += len(encode_block(block))

    def _serve(self) -> None:
        for output in self._out:
            self._companions.feed(output)
            if isinstance(output, StopProgram):
                self._braking = True
            elif isinstance(output, GuardEvent):
                self._hear(output)
        self._out.clear()

    def _hear(self, event: GuardEvent) -> None:
        self.recorded += len(encode_block(event.block()))
        if event.name == "activated":
            self._braking = False
        elif event.name == "stopping":
            self.stops += 1
            self.misnamed += event.details["why"] != "touch"
        elif event.name == "escalated" or (event.name == "fault" and "guide" not in event.details["what"]):
            self.trouble.append(f"{event.time:.3f} s {event.name}: {event.details}")

    def _person(self, now: float) -> None:
        """Reset; refused while the touch lasts."""
        if self.core.phase is Phase.LATCHED:
            self.core.feed(self._companions.reset(now), self._out)


def resident() -> int:
    """Bytes of this process in memory; the most there were where the system does not say."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << (0 if sys.platform == "darwin" else 10)


def descriptors() -> int:
    """Open descriptors of this process."""
    folder = Path("/proc/self/fd") if Path("/proc/self/fd").exists() else Path("/dev/fd")
    return len(list(folder.iterdir()))


def hours(day: Day, total: float) -> Iterator[dict[str, Any]]:
    """Run; a report for each hour, or for each tenth of less than ten."""
    reports = max(10, round(total))
    each = round(total * 3600 * RATE_HZ / reports)
    gc.collect()
    gc.freeze()
    gc.disable()
    for number in range(1, reports + 1):
        began = time.perf_counter()
        day.run(each)
        seconds = time.perf_counter() - began
        yield {
            "hours": round(number * each / RATE_HZ / 3600, 4),
            "frames_per_s": round(each / seconds),
            "resident": resident(),
            "descriptors": descriptors(),
            "objects": len(gc.get_objects()),
            "touches": day.touches,
            "stops": day.stops,
        }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0, help="of frames at 1 kHz (%(default)g)")
    parser.add_argument("--touch-every-s", type=float, default=60.0, help="(%(default)g)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print one JSON object at the end")
    args = parser.parse_args()
    machine = head()
    show = sys.stderr if args.json else sys.stdout
    print(f"{machine}\n\n{'hours':>9}{'frames/s':>10}{'MB':>10}{'objects':>10}{'files':>7}{'touches':>9}", file=show)
    day = Day(args.seed, args.touch_every_s)
    reports = []
    began = time.perf_counter()
    try:
        for report in hours(day, args.hours):
            reports.append(report)
            print(
                f"{report['hours']:9.3f}{report['frames_per_s']:10}{report['resident'] / 1e6:10.2f}"
                f"{report['objects']:10}{report['descriptors']:7}{report['touches']:9}",
                file=show,
                flush=True,
            )
    except KeyboardInterrupt:
        print("interrupted: this is how far it got", file=sys.stderr)
    problems = [*day.trouble[:5], *judge(day, reports)]
    growth = reports[-1]["resident"] - reports[0]["resident"] if reports else 0
    seconds = time.perf_counter() - began
    facts = {
        "machine": machine,
        "frames": day.frames,
        "seconds": round(seconds, 1),
        "growth": growth,
        "touches": day.touches,
        "stops": day.stops,
        "called_a_fault": day.misnamed,
        "recorded": day.recorded,
        "reports": reports,
        "problems": problems,
    }
    if args.json:
        print(json.dumps(facts))
    else:
        print(f"\n{day.frames} frames in {seconds:.1f} s; memory grew by {growth / 1e3:.0f} kB")
        print(f"{day.touches} touches, {day.stops} stops, of which {day.misnamed} called a fault", end="; ")
        print(f"a recording of it has {day.recorded / 1e9:.3f} GB")
        print("\n".join(f"PROBLEM: {line}" for line in problems) or "no growth, no missed touch, no other stop")
    return 1 if problems else 0


def judge(day: Day, reports: list[dict[str, Any]]) -> Iterator[str]:
    """Yield what must not be, one line each."""
    if len(reports) > 1:
        first, last = reports[0], reports[-1]
        if last["resident"] - first["resident"] > MAX_GROWTH:
            yield f"memory grew from {first['resident']} to {last['resident']} bytes"
        if last["descriptors"] != first["descriptors"]:
            yield f"descriptors went from {first['descriptors']} to {last['descriptors']}"
    if day.stops != day.touches:
        yield f"{day.touches} touches and {day.stops} stops"
