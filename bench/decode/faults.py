"""Faults of the virtual skin: is each named correctly, and is none taken for "no touch"?

    python -m bench decode-faults --cases 500 [--first 0]

A case is a sensor with its electronics, a fault, the frame at which it begins, and a touch that begins before, with or
after it, or none. The last name counts: the first frame that shows something stops the arm, the name may follow. Right
is a name that docs/look-up/wire-format.md has for the fault, or, where that page says so, a touch.
"""

from __future__ import annotations

import argparse
import math
import random
from dataclasses import dataclass, replace

from bench.report import head, show
from coneskin.core.errors import SkinConnectionError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import SkinFault, TouchBegan
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Polarity, match_electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTHS

from .fault_kinds import FaultCase, draw_kind

Answers = dict[str, dict[str, int]]  # fault -> verdict and last name, or what was counted -> how often

FAULT_FRAMES = 70, 90  # frame
NAMING_FRAMES = 230  # frames after fault and touch, in which the name comes
TIMING_EVERY = 3  # one in so many cases is compared with a healthy sensor, frame by frame
SILENCE_TIME = 0.03  # s
STUCK_FRAMES = 25  # frames in a row that count as stuck here
SENSOR_CONES = {
    "forearm": Frustum(0.0375, 0.0375, 0.24, math.radians(350)),
    "cone": Frustum(0.03, 0.06, 0.15, math.radians(340)),
    "upper arm": Frustum(0.054, 0.054, 0.434),
}
_PLACE_TOLERANCE = 0.005  # m; a certain place that is farther off is a wrong one


@dataclass
class Account:
    """What a detector said of a case."""

    first: str = ""
    last: str = ""
    first_frame: int = -1  # that reported anything at all
    named_frame: int = -1  # of the last name
    began: bool = False
    place_off: float = 0.0  # m, of a place that it called certain


def sensor_of(rng: random.Random) -> Sensor:
    """Return one of the sensors, with one of the polarities, of 12 or 16 bits."""
    cone = SENSOR_CONES[rng.choice(list(SENSOR_CONES))]
    polarity = Polarity(rng.choice(("B", "A")), rng.choice(("C", "D")))
    plain = Sensor(cone, polarity=polarity)
    parts = match_electronics(plain.radial_ohms, plain.angular_ohms)
    return replace(plain, electronics=replace(parts, adc_bits=rng.choice((12, 12, 16))))


def touch_of(rng: random.Random, sensor: Sensor, begins: int, case: FaultCase) -> ScriptedTouch | None:
    """Return a firm touch, or none where the fault shows without."""
    if rng.random() >= 0.6 and case.shows:
        return None
    when = 1e-3 * (begins + rng.choice((-40, -10, 10, 40, 80) if case.shows else (10, 40, 80)))
    cone = sensor.frustum
    place = rng.uniform(0.01, cone.slant - 0.01), rng.uniform(0.1, cone.wrap - 0.1)
    force = math.exp(rng.uniform(math.log(3.0), math.log(40.0)))
    ends = when + 0.12 if case.released else rng.choice((when + 0.12, 1.0))  # s; it is released, or it stays
    return ScriptedTouch(when, ends, *place, force=force, rise=0.001)


def listen(sensor: Sensor, skin: VirtualSkin, touch: ScriptedTouch | None) -> Account:
    """Return what a detector says of a skin."""
    stream, said = TouchStream([sensor], DetectorSettings(stuck_frames=STUCK_FRAMES)), Account()
    now, frame = 0.0, -1
    detector = stream.detectors[0]
    radius = max(sensor.frustum.radius1, sensor.frustum.radius2)
    try:
        for frame, (time, data) in enumerate(skin.packets()):
            now = time
            for event in (*(stream.feed(data, now) if data else ()), *stream.silence(now, SILENCE_TIME)):
                if isinstance(event, SkinFault):
                    said.first = said.first or event.fault.name
                    if event.fault.name != said.last:
                        said.last, said.named_frame = event.fault.name, frame
                said.began = said.began or isinstance(event, TouchBegan)
                said.first_frame = frame if said.first_frame < 0 else said.first_frame
            reading = detector.reading_now
            if touch is not None and reading is not None and reading.location_valid and detector.fault is None:
                off = math.hypot(reading.u - touch.u, radius * (reading.phi - touch.phi))
                said.place_off = max(said.place_off, off)
    except SkinConnectionError:
        if now < skin.duration - 0.002:
            said.first = said.last = said.last or "unplugged"
            said.first_frame = said.first_frame if said.first_frame >= 0 else frame
    return said


@dataclass
class Outcome:
    """A case and what came of it.

    Attributes:
        case: the fault.
        said: of it by the detector.
        verdict: right, wrong, or silent.
        late: frames by which a touch was shown later than by a healthy sensor; None where that was not compared.
    """

    case: FaultCase
    said: Account
    verdict: str
    late: int | None = None


def play(number: int) -> Outcome:
    """Run a case."""
    rng = random.Random(f"fault {number}")
    sensor = sensor_of(rng)
    begins = rng.randint(*FAULT_FRAMES)
    length = rng.choice(FRAME_LENGTHS)
    case = draw_kind(rng, number, sensor, begins, driven=length == FRAME_LENGTHS[-1])
    touch = touch_of(rng, sensor, begins, case)

    def skin(faults: FaultInjection, duration: float) -> VirtualSkin:
        return VirtualSkin(
            sensor,
            [touch] if touch else [],
            seed=number,
            faults=faults,
            model="ladder",
            duration=duration,
            imperfections=Imperfections(noise_counts=case.noise),
            frame_length=length,
        )

    ends = max(1e-3 * begins, touch.start if touch else 0.0) + 1e-3 * NAMING_FRAMES
    said = listen(sensor, skin(case.faults, ends), touch)
    outcome = Outcome(
        case, said, case.judge(said.last, said.began, said.place_off > _PLACE_TOLERANCE, touch is not None)
    )
    if touch is not None and not case.swallows and number % TIMING_EVERY == 0:
        until = 1e-3 * math.ceil(1e3 * touch.start + 8.0)
        healthy = listen(sensor, skin(FaultInjection(), until), None)
        shown = said.first_frame if said.first_frame >= 0 else NAMING_FRAMES
        outcome.late = max(0, shown - healthy.first_frame)
    return outcome


def count(cases: range) -> Answers:
    """Play cases; return what was said of each kind of fault."""
    found: Answers = {}
    for number in cases:
        try:
            outcome = play(number)
        except ArithmeticError as error:  # a decoder that crashes is a finding, not the end of the run
            row, key = found.setdefault("any", {}), f"crash: {error!r}"
            row[key] = row.get(key, 0) + 1
            row.setdefault("first " + key, number)
            continue
        said, late = outcome.said, outcome.late
        row = found.setdefault(outcome.case.name, {})
        key = f"{outcome.verdict}: {said.last or ('touch' if said.began else 'nothing')}"
        row[key] = row.get(key, 0) + 1
        row.setdefault("first " + key, number)
        if late is not None:
            row["timed"] = row.get("timed", 0) + 1
        if late:
            row["late"] = row.get("late", 0) + 1
            row["latest"] = max(row.get("latest", 0), late)
        if said.first != said.last:
            row["renamed"] = row.get("renamed", 0) + 1
            row["frames"] = max(row.get("frames", 0), said.named_frame - said.first_frame)
    return found


def show_answers(found: Answers) -> bool:
    """Show the goals and a row for each kind of fault; return whether all goals are met."""
    rows, right, done, silent, late, timed = [], 0, 0, 0, 0, 0
    for fault, row in sorted(found.items()):
        verdicts = {k: v for k, v in row.items() if ": " in k and not k.startswith("first")}
        good = {k.removeprefix("right: "): v for k, v in verdicts.items() if k.startswith("right")}
        names = ", ".join(f"{k} {v}" for k, v in sorted(good.items(), key=lambda each: -each[1]))
        bad = {k: v for k, v in verdicts.items() if not k.startswith("right")}
        other = ", ".join(f"{k} ({v}, e.g. case {row['first ' + k]})" for k, v in bad.items())
        renamed = f"{row['renamed']}, in up to {row['frames']}" if "renamed" in row else ""
        behind = f"{row['late']} of {row['timed']}, by up to {row['latest']}" if "late" in row else ""
        rows.append([fault, sum(verdicts.values()), sum(good.values()), names, renamed, behind, other])
        right, done = right + sum(good.values()), done + sum(verdicts.values())
        silent += sum(v for k, v in bad.items() if k.startswith("silent"))
        late, timed = late + row.get("late", 0), timed + row.get("timed", 0)
    goals = (
        ("named correctly: 99.9 %", f"{100.0 * right / done:.2f} % of {done}", right >= 0.999 * done),
        ('none taken for "no touch"', f"{silent} of {done}", not silent),
        ("a touch shows on the frame on which a healthy sensor shows it", f"{timed - late} of {timed}", not late),
    )
    show("goals", ["goal", "measured", "met"], [[*goal, "yes" if met else "no"] for *goal, met in goals])
    columns = ["fault", "cases", "right", "last names", "renamed, frames", "touch late, frames", "otherwise"]
    show("faults, and the last name of each", columns, rows)
    return all(met for *_, met in goals)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500, help="random cases (%(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (%(default)s)")
    args = parser.parse_args()
    print(head())
    return int(not show_answers(count(range(args.first, args.first + args.cases))))
