"""Cost of publishing events for the guard's loop: its processor time for each frame, with and without a publisher.

    python -m bench publish [--seconds 10] [--rounds 3]

A virtual skin of 1 kHz is touched ten times a second, so that there are events to publish; the two cases take turns.
"""

from __future__ import annotations

import argparse
import socket
import statistics
from pathlib import Path

from bench.report import head, show
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.scene.reader import parse_scene
from coneskin.session.event_publisher import EventPublisher
from coneskin.session.session import Session, guard

FRAME_RATE = 1000.0  # Hz
TOUCH_RATE = 10  # a second
SCENE_TEXT = """\
[[link]]
name = "tube"
[[link.sensor]]
radius1_mm = 41
radius2_mm = 40
height_mm = 240
[source]
kind = "virtual"
model = "ladder"
rate_hz = 1000
[monitoring]
skin_silence_ms = 1000
"""
TOUCH_TEXT = "[[source.touch]]\nstart_s = {}\nend_s = {}\nu_mm = 120\nphi_deg = 90\n"


def scene_text(seconds: float) -> str:
    """The scene with its touches."""
    times = [number / TOUCH_RATE for number in range(int((seconds + 5.0) * TOUCH_RATE))]
    touches = "".join(TOUCH_TEXT.format(1.0 + time, 1.0 + time + 0.5 / TOUCH_RATE) for time in times)
    return SCENE_TEXT.replace("[monitoring]", touches + "[monitoring]")


def processor_time(pid: int) -> float:
    """Time that a process has run [s]."""
    return int(Path(f"/proc/{pid}/schedstat").read_text().split()[0]) * 1e-9


def measure(seconds: float, publish: bool) -> tuple[float, int, int]:
    """Processor time of the guard for each frame [us], events, and datagrams that came."""
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    receiver.setblocking(False)
    publisher = EventPublisher(f"udp://127.0.0.1:{receiver.getsockname()[1]}")
    session: Session

    def show(event: GuardEvent) -> None:
        if publish:
            publisher.publish(event, session.began)

    session = guard(parse_scene(scene_text(seconds)), on_event=show)
    with session:
        pid = session._processes.children["guard"].pid
        before, start = processor_time(pid), len(session.events)
        session.wait_for(("none",), seconds)
        spent, events = processor_time(pid) - before, len(session.events) - start
    came = 0
    while True:
        try:
            receiver.recv(65536)
        except BlockingIOError:
            break
        came += 1
    publisher.close()
    receiver.close()
    return 1e6 * spent / (seconds * FRAME_RATE), events, came


def main() -> None:
    """Measure both cases by turns, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    print(head())
    found: dict[bool, list[float]] = {False: [], True: []}
    for _ in range(args.rounds):
        for publish in (False, True):
            spent, events, came = measure(args.seconds, publish)
            found[publish].append(spent)
            print(
                f"  {'with' if publish else 'without':>7}: {spent:6.2f} us a frame, {events} events, {came} datagrams"
            )
    without, with_it = statistics.median(found[False]), statistics.median(found[True])
    row = [f"{without:.2f}", f"{with_it:.2f}", f"{with_it - without:+.2f}"]
    show("us a frame, median of the rounds; at most 20 more", ["without", "with a publisher", "more"], [row])
