"""Errors of random skins before and after a calibration by 4, 9 and 16 touches.

    python -m bench calibrate                  # 200 skins, two minutes
    python -m bench calibrate --quick          # 20 skins

Each skin is a UR5e forearm's, whose scene says 1 ohm for each lead. It has others at random, or the scene is right. The
marks are placed and touched with errors; the sheets are ideal resistors with a point contact; the circuit, the noise of
the converter and the decoder are the live ones. Errors are distances on the surface at places anywhere but the
outermost 3 %, one frame each.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
import sys
from dataclasses import replace

from bench.report import head, quantile, show
from coneskin.commissioning.calibration.calibrate import MARK_COUNTS, calibration_marks
from coneskin.commissioning.calibration.fit import KnownTouch, fit_map
from coneskin.commissioning.misreadings import Place
from coneskin.core.errors import SkinError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.electronics import LeadOhms
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.skin import VirtualSkin

FOREARM_CONE = Frustum(0.0375, 0.0375, 0.24, math.radians(350.0))
MARK_ERROR = 0.3e-3  # m, standard deviation along and around each
MARK_FRAMES = 20  # of each touch of a mark
PLACE_COUNT = 40  # at which each skin is judged
CONTACT_CONDUCTANCE = 2e-3  # S
LEAD_RANGES = {"leads of 3 to 12 ohm": (3.0, 12.0), "a perfect skin": (1.0, 1.0)}


class Bench:
    """One random skin."""

    def __init__(self, known: Sensor, leads: tuple[float, float], seed: int) -> None:
        self.known, self.rng = known, random.Random(seed)
        ohms = LeadOhms(*(self.rng.uniform(*leads) for _ in range(4)))
        self.built = replace(known, electronics=replace(known.electronics, lead_ohms=ohms))
        self.cone = known.frustum

    def touch(self, place: Place, frames: int = 1) -> Place:
        """Return the mean of what some frames of a touch are decoded to."""
        skin = VirtualSkin(self.built, model=_Held(place), imperfections=Imperfections(settling_time=0.0))
        skin.seed = self.rng.getrandbits(32)
        seen = [read(self.known, frame).centre for _, (_, frame) in zip(range(frames), skin.frames(), strict=False)]
        return Place(*(statistics.fmean(values) for values in zip(*seen, strict=True)))

    def known_touches(self, count: int) -> list[KnownTouch]:
        """Touch marks that are not quite where they should be."""
        touches = []
        for mark in calibration_marks(self.known, count):
            around = self.rng.gauss(0.0, MARK_ERROR) / self.cone.radius_at(mark.u)
            true = Place(mark.u + self.rng.gauss(0.0, MARK_ERROR), mark.phi + around)
            touches.append(KnownTouch(mark.place, self.touch(true, MARK_FRAMES)))
        return touches

    def judged(self) -> list[KnownTouch]:
        """Touch places anywhere."""
        places = [
            Place(self.rng.uniform(0.03, 0.97) * self.cone.slant, self.rng.uniform(0.03, 0.97) * self.cone.wrap)
            for _ in range(PLACE_COUNT)
        ]
        return [KnownTouch(place, self.touch(place)) for place in places]

    def distance(self, place: tuple[float, float], other: Place) -> float:
        """Return the distance of two places along the surface [mm]."""
        around = self.cone.radius_at(other.u) * math.remainder(place[1] - other.phi, 2.0 * math.pi)
        return 1e3 * math.hypot(place[0] - other.u, around)


class _Held(ResistorLadder):
    """Sheets with one contact that is always there."""

    def __init__(self, place: Place) -> None:
        self._contact = LayerContact(*place, CONTACT_CONDUCTANCE)

    def admittances(self, sensor, scenes):  # type: ignore[no-untyped-def]
        return [self.admittance(sensor, [self._contact])] * len(scenes)


def measure(leads: tuple[float, float], skins: int) -> dict[str, list[float]]:
    """Return all errors [mm], before a calibration and after one by each number of touches."""
    known = Sensor(FOREARM_CONE)
    found: dict[str, list[float]] = {"before": [], **{f"{count} touches": [] for count in MARK_COUNTS}}
    for seed in range(skins):
        bench = Bench(known, leads, seed)
        judged = bench.judged()
        found["before"] += [bench.distance(touch.read, touch.mark) for touch in judged]
        for count in MARK_COUNTS:
            try:
                place_map = fit_map(known, bench.known_touches(count), MARK_ERROR).place_map
            except SkinError as exc:
                print(f"refused: {exc}", file=sys.stderr)
                continue
            found[f"{count} touches"] += [bench.distance(place_map.apply(*one.read), one.mark) for one in judged]
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="20 skins of each kind")
    args = parser.parse_args()
    skins = 20 if args.quick else 200
    print(head())
    rows = []
    for name, leads in LEAD_RANGES.items():
        found = measure(leads, skins).values()
        shares = ((quantile(errors, share) for share in (0.5, 0.95, 1.0)) for errors in found)
        rows.append([name, *(" / ".join(f"{value:.2f}" for value in values) for values in shares)])
    title = f"errors in mm: median / 95 % / largest; {skins} skins, {PLACE_COUNT} places on each"
    show(title, ["", "before", *(f"{count} touches" for count in MARK_COUNTS)], rows)
