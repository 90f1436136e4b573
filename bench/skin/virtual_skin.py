"""Whether the virtual skin keeps its time: what a frame costs while touches change, and how late frames leave.

    python -m bench virtual-skin

The first table is the processor time from frame to frame, without pacing, in microseconds: a frame each millisecond
has 1000. The worst is a frame with which the next eight are solved, or the places of touches are prepared. The second
paces the frames in real time, as ``coneskin.session.skin_process`` does, adds touches while it runs, and says how
late frames left (what else the machine does included: look at the ladder's row), the processor time, and the longest
from the start of a touch to the device clock of the first frame that shows it.
"""

import gc
import time
from collections.abc import Iterable

from bench.report import head
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.pseudo_terminal import Pacing, play
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import frame_at

LINK_CONE = Frustum(0.03762, 0.0373, 0.24)
TOUCH_DELAY = 0.002  # as in coneskin.session.skin_process


def main() -> None:
    print(head())
    equal, unequal = Sensor(LINK_CONE), Sensor(LINK_CONE, lower_sheet_ohms=300.0)
    row("us per frame", ("median", "p99", "worst"))
    for model in ("ladder", "field"):
        for name, sensor, places in (
            ("untouched", equal, ()),
            ("one touch, always changing", equal, ((0.13, 2.0),)),
            ("the same, unequal sheets", unequal, ((0.13, 2.0),)),
            ("two touches, always changing", equal, ((0.13, 2.0), (0.05, 4.0))),
            ("three touches, always changing", equal, ((0.13, 2.0), (0.05, 4.0), (0.2, 1.0))),
        ):
            # a force that rises for 20 s changes in every phase of every frame
            touches = [ScriptedTouch(0.0, 100.0, u, phi, force=20.0, rise=20.0) for u, phi in places]
            skin = VirtualSkin(sensor, touches, model=model, duration=10.0)
            figures = spans(skin.packets())
            row(f"{model}: {name}", (figures[len(figures) // 2], figures[-len(figures) // 100], figures[-1]))
    print()
    row("in real time, 1 kHz, touched every 250 ms", ("late, ms", "CPU, %", "shown, ms"))
    for name, sensors, several, model in (
        ("one sensor, ladder", [equal], 1, "ladder"),
        ("one sensor", [equal], 1, "field"),
        ("one sensor, two touches at once", [equal], 2, "field"),
        ("two sensors", [equal, Sensor(LINK_CONE, 1, lower_sheet_ohms=300.0)], 1, "field"),
    ):
        row(name, in_real_time(sensors, several, model))


def spans(items: Iterable[object]) -> list[float]:
    """Times between items, sorted [us]."""
    gc.collect()
    clock, out = time.thread_time, []
    gone = iter(items)
    while True:
        start = clock()
        try:
            next(gone)
        except Exception:  # the device has gone, or its time is over
            return sorted(out)
        out.append(1e6 * (clock() - start))


def in_real_time(sensors: list[Sensor], several: int, model: str, seconds: float = 5.0) -> tuple[float, float, float]:
    """Worst lateness [ms], CPU [%], and the longest from a touch to the clock of the frame that shows it [ms]."""
    skin, pacing = VirtualSkin(sensors, model=model, duration=seconds), Pacing()
    began, asked, seen = time.monotonic(), [0.0], [0.0]
    starts: list[float] = []
    arrivals: list[float] = []

    def wait(left: float) -> bool:
        time.sleep(left)
        now = time.monotonic() - began
        if now >= asked[0] + 0.25 and now < seconds - 0.3:
            asked[0] = now
            starts.append(now + TOUCH_DELAY)
            for n in range(several):
                for sensor in sensors:
                    place = (0.03 + 0.01 * (len(starts) % 15) + 0.04 * n, 1.0 + 2.0 * n)
                    skin.touch(ScriptedTouch(now + TOUCH_DELAY, now + 0.1, *place, rise=0.001, sensor=sensor.name))
        return False

    def write(data: bytes) -> bool:
        frame = frame_at(data)
        touched = frame is not None and frame.sensor == 0 and frame.touch_c > 200
        if touched and not seen[0]:
            arrivals.append(frame.clock_us * 1e-6 if frame else 0.0)
        if frame is not None and frame.sensor == 0:
            seen[0] = touched
        return True

    used = time.process_time()
    play(skin, write, wait=wait, pacing=pacing)
    cpu = (time.process_time() - used) / (time.monotonic() - began)
    shown = max(arrival - start for start, arrival in zip(starts, arrivals, strict=True))
    return 1e3 * pacing.worst_late, 100 * cpu, 1e3 * shown


def row(name: str, figures: tuple[object, ...]) -> None:
    print(f"{name:44}" + "".join(f"{f:>10.1f}" if isinstance(f, float) else f"{f!s:>10}" for f in figures))
