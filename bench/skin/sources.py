"""Eight sensors at 2 kHz on two ports, read, decoded and judged by one thread: what it costs, and what is lost.

    python -m bench sources --seconds 600
    python -m bench sources --seconds 600 --wait     on a busy machine

A child plays the frames into two pseudo-terminals by absolute deadlines; it waits for nobody, so what the reader does
not take in time is lost, as on a line. One core is enough where the reader's processor time stays below the time that
is played. With --wait the child waits for the reader, and time is that of the stream: what the frames cost is then
measured however busy the machine is.
"""

import argparse
import os
import subprocess
import sys
import time

from bench.report import head, show
from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.sources.source import SourceGroup
from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal, write_all
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, encode

PORTS, EACH, RATE = 2, 4, 2000.0  # ports, sensors of a port, Hz
FRUSTUM = Frustum(0.054, 0.054, 0.3)


def sensors() -> list[Sensor]:
    return [Sensor(FRUSTUM, number, device_id=port) for port in range(PORTS) for number in range(EACH)]


def play(seconds: float, waits: bool) -> None:
    """Play in the child: the counts of a virtual skin over and over, with sequence and clock of their own."""
    base: list[Frame] = [f for _, f in VirtualSkin(sensors()[0], rate_hz=RATE, model="ladder", duration=0.5).frames()]
    ends = [open_raw_terminal() for _ in range(PORTS)]
    for master, _, _ in ends:
        os.set_blocking(master, waits)
    print(*(path for _, _, path in ends), flush=True)
    sys.stdin.readline()
    late = lost = 0
    worst = 0.0
    start = time.monotonic()
    for number in range(int(seconds * RATE)):
        due = start + number / RATE
        if not waits and (left := due - time.monotonic()) > 0.0:
            time.sleep(left)
        behind = 0.0 if waits else time.monotonic() - due
        late += behind > 0.05
        worst = max(worst, behind)
        clock = int(number * 1e6 / RATE) & 0xFFFFFFFF
        frame = base[number % len(base)]._replace(sequence=number & 0xFFFF, clock_us=clock)
        for port, (master, _, _) in enumerate(ends):
            data = b"".join(encode(frame._replace(device=port, sensor=sensor)) for sensor in range(EACH))
            lost += not write_all(master, data)
    print(f"{late} {lost} {worst:.4f}", flush=True)
    sys.stdin.readline()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--wait", action="store_true", help="the child waits for the reader")
    parser.add_argument("--play", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.play:
        play(args.seconds, args.wait)
        return
    child = subprocess.Popen(
        [sys.executable, "-m", "bench", "sources", "--play", "--seconds", str(args.seconds), *(["--wait"] * args.wait)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    stream = TouchStream(sensors())
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # one core, really
    faults: dict[str, int] = {}
    reads = 0
    with SourceGroup([SerialPort(path) for path in child.stdout.readline().split()]) as source:
        child.stdin.write("\n")
        child.stdin.flush()
        start, used = time.monotonic(), time.process_time()
        while args.wait or time.monotonic() - start < args.seconds + 30.0:
            try:
                data = source.read(20.0 if args.wait else 2.0)
            except (SkinTimeout, SkinConnectionError):
                break
            reads += 1
            now = stream.decoder.frames / (PORTS * EACH * RATE) if args.wait else time.monotonic()
            for event in stream.feed(data, now):
                name = getattr(getattr(event, "fault", None), "name", type(event).__name__)
                faults[name] = faults.get(name, 0) + 1
        wall, used = time.monotonic() - start - (20.0 if args.wait else 2.0), time.process_time() - used
        child.stdin.write("\n")
        child.stdin.flush()
        late, lost, worst = child.stdout.readline().split()
    child.wait()
    frames = stream.decoder.frames
    sent = int(args.seconds * RATE) * PORTS * EACH
    missing = sum(detector.timing.missing for detector in stream.detectors)
    print(head())
    print(f"{PORTS * EACH} sensors at {RATE:.0f} Hz on {PORTS} ports for {args.seconds:.0f} s, read in {wall:.1f} s")
    row = [frames, sent, missing, stream.decoder.bytes_skipped, f"{used / args.seconds:.1%}"]
    columns = ["frames", "sent", "missing by sequence", "bytes skipped", "share of a core", "us a frame"]
    show("processor time, and what was lost", columns, [[*row, f"{1e6 * used / max(frames, 1):.1f}"]])
    print(f"reads: {reads}; the child was over 50 ms late {late} times (at worst {worst} s), writes lost {lost}")
    print(f"events: {faults or 'none'}")
