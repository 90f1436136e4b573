"""Errors of random skins before and after a calibration by 4, 9 and 16 touches.

    python -m bench calibrate                  # 200 skins, five minutes
    python -m bench calibrate --skins 20

Each skin is a UR5e forearm's, whose scene says 1 ohm for each lead. It has others at random, or the scene is right. The
marks are placed and touched with errors; the sheets are ideal resistors with a point contact; the circuit, the noise of
the converter and the decoder are the live ones. Errors are distances on the surface at places anywhere but the
outermost 3 %, one frame each.

Sheets that are not ideal are drawn from their class (`skin/virtual/built_sheets`), their potentials read without noise.
The bound is the error of the best linear estimate of a place from the marks, which has the covariance of the class from
three quarters of the skins, and no map to go through; it is judged on the last quarter, and so is `fit_map`. "Best" are
marks each where it tells most.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
import sys
from dataclasses import replace
from itertools import product

import numpy as np

from bench.report import head, quantile, show
from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.calibration.fit import KnownTouch, fit_map
from coneskin.commissioning.misreadings import Place
from coneskin.core.errors import SkinError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.electronics import LeadOhms
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import COATED_SHEETS, FILM_SHEETS, SheetTolerance
from coneskin.skin.virtual.built_sheets import _BuiltSheet, _draw_flaws
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.skin import VirtualSkin

FOREARM_CONE = Frustum(0.0375, 0.0375, 0.24, math.radians(350.0))
MARK_COUNTS = (4, 9, 16)
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
        for mark in _calibration_marks(self.known, count):
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


SITES = list(product(np.linspace(0.04, 0.96, 14), repeat=2))  # parts of the sides at which built sheets are judged


class BuiltSkins:
    """What skins of a class read wrongly along and around [m], at parts of the sides."""

    def __init__(self, tolerance: SheetTolerance, skins: int) -> None:
        self.known, self.rng = Sensor(FOREARM_CONE, tolerance=tolerance), np.random.default_rng(0)
        cone = self.known.frustum
        self.size = cone.slant, cone.wrap * cone.radius1
        self.skins, self.first = skins, 3 * skins // 4
        self.fields = np.array([self._draw(tolerance, seed) for seed in range(skins)])
        self.judged = self.at(SITES)

    def _draw(self, tolerance: SheetTolerance, seed: int) -> tuple[np.ndarray, np.ndarray]:
        rng = random.Random(f"leads {seed}")
        found = []
        for number, flaws in enumerate(_draw_flaws(tolerance, seed)):
            size = self.size if number == 0 else self.size[::-1]
            sheet = _BuiltSheet(flaws, size, self.known.upper_sheet_ohms)
            before, after = (abs(rng.gauss(0.0, tolerance.lead)) for _ in range(2))
            ohms = 1.0 / sheet.own[1, 1]
            nodes = math.isqrt(len(sheet.answer))
            read = (sheet.answer[:, 1].reshape(nodes, nodes) * ohms + before) / (ohms + before + after)
            wrong = size[0] * (read - np.linspace(0.0, 1.0, nodes)[:, None])
            found.append(wrong if number == 0 else wrong.T)
        return found[0], found[1]

    def at(self, places: list[tuple[float, float]]) -> np.ndarray:
        """Return the errors at places, shape (skins, 2, places)."""
        from scipy.ndimage import map_coordinates

        nodes = (self.fields.shape[-1] - 1) * np.array(places).T
        return np.array([[map_coordinates(axis, nodes, order=1) for axis in skin] for skin in self.fields])

    def best(self, count: int) -> list[tuple[float, float]]:
        """Return the places that tell most, one after another."""
        left = [axis.T @ axis / self.first for axis in self.judged[: self.first].swapaxes(0, 1)]
        chosen = []
        for _ in range(count):
            most = int(np.argmax(sum((k**2).sum(axis=0) / (np.diag(k) + MARK_ERROR**2) for k in left)))
            left = [k - np.outer(k[most], k[most]) / (k[most, most] + MARK_ERROR**2) for k in left]
            chosen.append(SITES[most])
        return chosen

    def bound(self, marks: list[tuple[float, float]]) -> float:
        """Return the rms error of the best linear estimate [mm]."""
        touched, square = self.at(marks), 0.0
        noisy = touched + self.rng.normal(0.0, MARK_ERROR, touched.shape)
        for axis in range(2):
            a, b = touched[: self.first, axis], self.judged[: self.first, axis]
            gain = b.T @ a @ np.linalg.inv(a.T @ a + self.first * MARK_ERROR**2 * np.eye(len(marks)))
            square += float(np.mean((self.judged[self.first :, axis] - noisy[self.first :, axis] @ gain.T) ** 2))
        return 1e3 * math.sqrt(square)

    def place(self, part: tuple[float, float], wrong: np.ndarray) -> Place:
        """Return where a place is read."""
        return Place(
            part[0] * self.size[0] + wrong[0], (part[1] * self.size[1] + wrong[1]) / self.known.frustum.radius1
        )

    def fitted(self, count: int) -> tuple[float, float, int]:
        """Return the rms error after ``fit_map`` [mm], what it claims over that, and how many skins it refused."""
        marks = [(m.u / self.size[0], m.phi / self.known.frustum.wrap) for m in _calibration_marks(self.known, count)]
        touched, squares, claims, refused = self.at(marks), [], [], 0
        none = np.zeros(2)
        for skin in range(self.first, self.skins):
            noisy = touched[skin] + self.rng.normal(0.0, MARK_ERROR, touched[skin].shape)
            touches = [
                KnownTouch(self.place(mark, none), self.place(mark, noisy[:, k])) for k, mark in enumerate(marks)
            ]
            try:
                fit = fit_map(self.known, touches, MARK_ERROR)
            except SkinError as exc:
                print(f"refused: {exc}", file=sys.stderr)
                refused += 1
                continue
            claims.append(2.0 * fit.map_error**2)
            for k, site in enumerate(SITES[::5]):
                true = self.place(site, none)
                read = fit.place_map.apply(*self.place(site, self.judged[skin, :, 5 * k]))
                around = self.known.frustum.radius1 * (read[1] - true.phi)
                squares.append((read[0] - true.u) ** 2 + around**2)
        error = math.sqrt(np.mean(squares))
        return 1e3 * error, math.sqrt(np.mean(claims)) / error, refused

    def rows(self, name: str) -> list[list[str]]:
        """Return the rows of a class."""
        before = f"{1e3 * math.sqrt(2.0 * np.mean(self.judged[self.first :] ** 2)):.2f}"
        found = []
        for count in MARK_COUNTS:
            marks = [
                (m.u / self.size[0], m.phi / self.known.frustum.wrap) for m in _calibration_marks(self.known, count)
            ]
            error, claim, refused = self.fitted(count)
            bounds = self.bound(marks), self.bound(self.best(count))
            cells = f"{error:.2f}", *(f"{one:.2f}" for one in bounds), f"{claim:.2f}"
            found.append([name, str(count), before, *cells, f"{refused} of {self.skins - self.first}"])
        return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--skins", type=int, default=200, help="of each kind, and thrice as many of a class (%(default)s)"
    )
    skins = parser.parse_args().skins
    print(head())
    rows = []
    for name, leads in LEAD_RANGES.items():
        found = measure(leads, skins).values()
        shares = ((quantile(errors, share) for share in (0.5, 0.95, 1.0)) for errors in found)
        rows.append([name, *(" / ".join(f"{value:.2f}" for value in values) for values in shares)])
    title = f"errors in mm: median / 95 % / largest; {skins} skins, {PLACE_COUNT} places on each"
    show(title, ["", "before", *(f"{count} touches" for count in MARK_COUNTS)], rows)
    rows = []
    for name, tolerance in (("film", FILM_SHEETS), ("coated", COATED_SHEETS)):
        rows += BuiltSkins(tolerance, 3 * skins).rows(name)
    columns = ["sheets", "marks", "before", "after", "bound", "bound, best", "claimed / true", "refused"]
    show(f"sheets of a class, marks off by {1e3 * MARK_ERROR:g} mm: rms at places not touched [mm]", columns, rows)
