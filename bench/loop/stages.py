"""Time from a frame at the port to a stop on the wire, stage by stage, beside the baseline of this machine.

    python -m bench loop [--touches 150] [--rate-hz 1000]

A process writes frames to a pseudo-terminal and states to a socket, at a steady pace, and notes when. In turns of some
seconds each they are read by

    baseline  a loop of poll, os.read and one send: the least that any Python program needs here
    guard     the guard's own loop with its core, as it runs live: pyserial's port, decode, detect, map, decide, send,
              record

The two take turns in one run, so that a busy machine is busy for both. What it does not show: ur_rtde, the controller
and the arm (bench `reaction`), a real serial adapter, and a machine with nothing else to do.
"""

from __future__ import annotations

import argparse
import gc
import os
import select
import socket
import sys
from dataclasses import dataclass, field

from bench.report import head, quantile
from coneskin.core.version import code_build
from coneskin.skin.wire import FRAME_LENGTH

from .far_end import CLOCK, CYCLE_FRAMES, FarEnd
from .guarded import Guarded


@dataclass
class Baseline:
    """Loop of poll, os.read and send.

    Attributes:
        wake: from a frame written to the same frame read [s].
        sent: from there to the end of the send [s].
        whole: both [s].
    """

    wake: list[float] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    def turn(self, rate_hz: float, seconds: float) -> None:
        """Read for some time."""
        ours, theirs = socket.socketpair()
        with FarEnd(rate_hz) as far:
            poll = select.poll()
            poll.register(far.slave, select.POLLIN)
            seen: list[tuple[int, float, float]] = []
            end = CLOCK() + seconds + 0.5
            gc.disable()
            while CLOCK() < end:
                if not poll.poll(100):
                    continue
                data = os.read(far.slave, 4096)
                read = CLOCK()
                ours.send(data[:9])
                if len(data) == FRAME_LENGTH:
                    seen.append((int.from_bytes(data[8:10], "little"), read, CLOCK()))
                theirs.recv(64)
            gc.enable()
            written = far.written()
        for sequence, read, sent in seen:
            if sequence in written:
                self.wake.append(read - written[sequence])
                self.sent.append(sent - read)
                self.whole.append(sent - written[sequence])
        ours.close()
        theirs.close()


TOUCHES = 25  # in a turn


def main() -> int:
    """Run the turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--touches", type=int, default=150)
    parser.add_argument("--rate-hz", type=float, default=1000.0)
    args = parser.parse_args()
    print(head())
    turns = max(1, args.touches // TOUCHES)
    seconds = TOUCHES * CYCLE_FRAMES / args.rate_hz
    baseline, guarded = Baseline(), Guarded()
    for turn in range(turns):
        for reader in (baseline, guarded):
            reader.turn(args.rate_hz, seconds)
        print(f"\r{100 * (turn + 1) // turns:3d} %", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{turns} turns of {seconds:.1f} s each at {args.rate_hz:g} frames/s\n")
    print(f"{'us':58}{'median':>9}{'p99':>9}{'p99.9':>9}{'worst':>10}")
    row("baseline: written at the far end -> read", baseline.wake)
    row("guard: written at the far end -> read", guarded.wake)
    row("baseline: read -> sent", baseline.sent)
    row("guard: READ -> COMMAND WRITTEN, touches", guarded.react)
    row("guard: read -> done, frames without a touch", guarded.idle)
    row("baseline: written at the far end -> sent", baseline.whole)
    row("guard: written at the far end -> command written", guarded.whole)
    if guarded.whole:
        ratio = quantile(guarded.whole, 0.5) / quantile(baseline.whole, 0.5)
        print(f"guard / baseline, written at the far end -> sent, median: {ratio:.2f} ({code_build()})")
    verdict(guarded)
    return 1 if guarded.missed else 0


def row(name: str, seconds: list[float]) -> None:
    """Print one line of the table."""
    if not seconds:
        print(f"{name:58}{'-':>9}")
        return
    values = [1e6 * s for s in seconds]
    print(f"{name:58}" + "".join(f"{quantile(values, share):9.1f}" for share in (0.5, 0.99, 0.999)), end="")
    print(f"{max(values):10.1f}")


def verdict(guarded: Guarded) -> None:
    """Say what became of the touches, and why there were other stops."""
    print(f"\ntouches answered by a stop: {guarded.answered}; of an active guard, missed: {guarded.missed}")
    print(f"touches while the guard was not active: {guarded.inactive.total()}")
    for why, count in guarded.inactive.most_common():
        print(f"  {count:4} times: {why}")
    print(f"stops for another reason than a touch: {guarded.other.total()}")
    for why, count in guarded.other.most_common():
        print(f"  {count:4} times: {why}")
