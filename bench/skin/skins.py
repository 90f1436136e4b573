"""Sixteen skins at 1 kHz on one core: bytes in, events out; share of the core, and how late the worst frame is.

    python -m bench skins [--skins 16] [--seconds 10] [--touched 4]

One process feeds each skin's frame when it is due, as a guard does, and waits for the next: its own time is counted,
and from when a frame was due to when its events were there. Some of the skins are touched all the time, each begins
anew twice a second. The times of the decode alone are measured without the computer's other work: `work`.
"""

from __future__ import annotations

# isort: split
import argparse
import gc
import random
import time

from bench.report import head, quantile
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import TouchBegan, TouchEnded
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, measure
from coneskin.skin.virtual.ladder import ResistorLadder
from coneskin.skin.wire import Frame, encode

PERIOD = 1e-3  # s
LEARNED, CYCLE, PRESSED = 300, 500, 400  # frames: before the first touch; from touch to touch; of them touched
NOISE = 0.7  # counts
SHAPE = Frustum(0.0375, 0.0375, 0.24, 6.1)


def stream_of_frames(sensor: Sensor, touched: bool, frames: int, seed: int) -> list[bytes]:
    """Return the bytes of a skin's frames."""
    rng, parts, ladder = random.Random(seed), sensor.electronics, ResistorLadder()
    volt, ampere = parts.full_count / parts.adc_volts, parts.full_count / parts.current_full_scale
    place = LayerContact(rng.uniform(0.05, 0.19), rng.uniform(1.0, 5.0), 1e-3)
    values = []
    for contacts in ((), (place,)):
        y = ladder.admittances(sensor, [contacts])[0]
        inputs = measure(sensor, (y, y, y))._asdict()
        values.append([x * (ampere if name.endswith("current") else volt) for name, x in inputs.items()])
    found = []
    for n in range(frames):
        pressed = touched and n >= LEARNED and (n - LEARNED + 31 * seed) % CYCLE < PRESSED
        counts = [max(0, round(v + rng.gauss(0.0, NOISE))) for v in values[pressed]]
        found.append(encode(Frame(2, 0, 0, 0, n & 0xFFFF, 1000 * n, *counts[:12])))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skins", type=int, default=16)
    parser.add_argument("--touched", type=int, default=4, help="skins that are touched all the time")
    parser.add_argument("--seconds", type=float, default=10.0)
    args = parser.parse_args()
    frames = LEARNED + round(args.seconds / PERIOD)
    sensors = [Sensor(SHAPE, name=f"skin {n}") for n in range(args.skins)]
    inputs = [stream_of_frames(s, n < args.touched, frames, n) for n, s in enumerate(sensors)]
    streams = [TouchStream([sensor]) for sensor in sensors]
    late: list[float] = []
    work: list[float] = []
    began = ended = 0
    gc.collect()
    gc.disable()
    clock = time.perf_counter
    start, spent = clock(), time.process_time()
    for n in range(frames):
        due = start + PERIOD * n
        wait = due - clock()
        if wait > 0.0:
            time.sleep(wait)
        turn = clock()
        for stream, data in zip(streams, inputs, strict=True):
            for event in stream.feed(data[n], PERIOD * n):
                began += isinstance(event, TouchBegan)
                ended += isinstance(event, TouchEnded)
        now = clock()
        late.append(now - due)
        work.append(now - turn)
    share = (time.process_time() - spent) / (clock() - start)
    print(head())
    print(
        f"\n{args.skins} skins at {1.0 / PERIOD:.0f} Hz, {args.touched} of them touched; {began} touches, {ended} ended"
    )
    print(f"share of a core: {100.0 * share:.0f} %")
    for name, values in (("work of a millisecond", work), ("from due to the last event", late)):
        parts = ", ".join(f"{q}: {1e3 * quantile(values, p):.2f}" for q, p in (("median", 0.5), ("99 %", 0.99)))
        print(f"{name} [ms]: {parts}, worst: {1e3 * max(values):.2f}")
    return 0
