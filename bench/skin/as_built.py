"""Skins as they are built, effect by effect: how far places are off, whether their ellipse holds them, what is named.

    python -m bench as-built                   # twenty minutes
    python -m bench as-built --skins 4 --rows "slope 5 %"

Each row draws skins whose flaws have the size of the row as their standard deviation; the decoder is told that size, or
"film" where it has no such number. Sheets: `skin/virtual/built_sheets`. The circuit is a nodal analysis of its own, and
the frames go as bytes into a stream. Four contacts a skin, 40 frames each, from the third on, then 100 without.

What can be known at all is the Fisher information of the counts of nine touches, 40 frames each: the Cramer-Rao
deviation of how much of an effect there is, its form known, over its size. Radius, conductance and supply are free.
Below a half it shows. What comes after learning has the touches alone, all else the untouched sensor as well.
"""

from __future__ import annotations

import argparse
import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bench.decode.cells import electronics
from bench.decode.plants import SHEETS
from bench.decode.runs import FRAME_PERIOD, LEARNED_FRAMES, Sitting, decode, packet
from bench.report import head, quantile, show
from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.examination.skin_examination import SkinStatistics, examine_sensor
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import COATED_SHEETS, FILM_SHEETS, IDEAL_SHEETS, SheetTolerance
from coneskin.skin.virtual.built_sheets import _BuiltSheets, _draw_flaws, _SheetFlaws
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.virtual.field_contacts import FieldContacts
from tests.support.field.converter_plant import ConverterPlant, leak_admittance

NAME, ELECTRIC = "UR5e", "12 bit, matched"
PLACE_COUNT = 4
FRAME_COUNT = 40
FIRST_FRAME = 2  # from which on a place is judged
ELLIPSE_CHI2 = 5.991
GUIDES = (0, 1, 3, 4, 6, 7)  # of the ten counts
CURRENTS = (2, 5, 8)
TAIL_COUNT = 100  # frames after a touch, in which a change of the untouched currents shows
SHOWN = 0.5  # Cramer-Rao deviation over the size of an effect, below which it can be known
KNOWN_SKINS = 6  # drawn for it; the median is told
MARK_ERROR, PLACE_ERROR = 3e-4, 1.0  # m; of a mark, and of a place that nobody knows
KNOWN_OHMS, MAKERS_OHMS = 3e-4, 0.2  # ratio; of the sheets, as a calibration has learned them, and as a maker says
RADIUS_ERROR, SIEMENS_ERROR = 0.5, 1.0  # of the logarithms
STEP = 1e-3  # of a logarithm, and of a place 0.2 mm, for derivatives
Frames = np.ndarray


@dataclass(frozen=True)
class Row:
    """One effect.

    Attributes:
        name: of it.
        told: what the decoder is told.
        sheets: tolerance from which the sheets are drawn.
        leads: standard deviation of each lead [ohm].
        peeled: part of one electrode.
        commissioned: the guard knows the untouched sheets as they were before it peeled off.
        speed: at which the contact slides [m/s].
        warmed: standard deviation by which the upper and the lower sheet change after learning, a ratio.
        stepped: least and most by which the upper sheet changes after learning, up or down, a ratio.
        damp: conductance between the layers after learning [S].
        change: of the exact counts, shape (..., frames, 10); told a random source.
        late: the sheets' flaws come after learning.
    """

    name: str
    told: SheetTolerance = IDEAL_SHEETS
    sheets: SheetTolerance = IDEAL_SHEETS
    leads: float = 0.0
    peeled: float = 0.0
    commissioned: bool = False
    speed: float = 0.0
    warmed: tuple[float, float] = (0.0, 0.0)
    stepped: tuple[float, float] = (0.0, 0.0)
    damp: float = 0.0
    change: Callable[[Frames, random.Random, ConverterPlant], Frames] | None = None
    late: bool = False


def _mains(volts: float) -> Callable[[Frames, random.Random, ConverterPlant], Frames]:
    def add(exact: Frames, rng: random.Random, circuit: ConverterPlant) -> Frames:
        turn = 2.0 * math.pi * (50.0 * FRAME_PERIOD * np.arange(exact.shape[-2]) + rng.random())
        exact[..., GUIDES] += volts / circuit.adc * (2**circuit.bits - 1) * np.sin(turn)[:, None]
        return exact

    return add


def _gain(part: float) -> Callable[[Frames, random.Random, ConverterPlant], Frames]:
    def scale(exact: Frames, rng: random.Random, _: ConverterPlant) -> Frames:
        exact[..., CURRENTS] *= 1.0 + part * rng.choice((-1.0, 1.0))
        return exact

    return scale


def _converter(offset: float, bend: float) -> Callable[[Frames, random.Random, ConverterPlant], Frames]:
    def bent(exact: Frames, rng: random.Random, circuit: ConverterPlant) -> Frames:
        turn = 2.0 * math.pi * exact / (2**circuit.bits - 1)
        return np.asarray(exact + rng.choice((-1.0, 1.0)) * (offset + bend * np.sin(turn)))

    return bent


def _one(**values: float) -> dict[str, SheetTolerance]:
    return {"told": SheetTolerance(**values), "sheets": SheetTolerance(**values)}


ROWS = (
    Row("ideal, at rest"),
    *(Row(f"ideal, slides at {speed:g} m/s", speed=speed) for speed in (0.05, 0.2, 0.5, 1.0)),
    *(Row(f"slope {100 * value:g} %", **_one(slope=value)) for value in (0.05, 0.2)),
    *(Row(f"skew {100 * value:g} %", **_one(skew=value)) for value in (0.02, 0.05)),
    Row("patches 5 %", **_one(patches=0.05)),
    *(Row(f"silver line {value:g} ohm", **_one(line=value)) for value in (2.0, 10.0, 50.0)),
    Row("leads 5 ohm", told=SheetTolerance(lead=5.0), leads=5.0),
    *(Row(f"{100 * part:g} % of an electrode peeled", told=FILM_SHEETS, peeled=part) for part in (0.2, 0.6)),
    *(
        Row(f"{100 * part:g} % peeled after commissioning", told=FILM_SHEETS, peeled=part, commissioned=True)
        for part in (0.2, 0.25, 0.3, 0.6)
    ),
    *(
        Row(f"both sheets {100 * v:g} % after learning", told=SheetTolerance(drift=v), warmed=(v, v))
        for v in (0.005, 0.02)
    ),
    Row("one sheet 1 % after learning", told=FILM_SHEETS, warmed=(0.01, 0.0)),
    Row("one sheet 1.2 to 4 % after learning", told=FILM_SHEETS, stepped=(0.012, 0.04)),
    *(
        Row(
            f"{100 * part:g} % of an electrode peels after learning",
            FILM_SHEETS,
            peeled=part,
            late=True,
        )
        for part in (0.2, 0.4)
    ),
    Row("damp, 20 uS after learning", told=FILM_SHEETS, damp=2e-5),
    Row("20 mV of mains on the guides", told=IDEAL_SHEETS, change=_mains(0.02)),
    Row("current gain 2 %", told=FILM_SHEETS, change=_gain(0.02)),
    Row("current gain 10 %", told=FILM_SHEETS, change=_gain(0.10)),
    Row("offset 4 LSB", told=SheetTolerance(reading=1e-3), change=_converter(4.0, 0.0)),
    Row("linearity 4 LSB", told=SheetTolerance(reading=1e-3), change=_converter(0.0, 4.0)),
    *(
        Row(f"{name}, all of it", told=of, sheets=of, leads=of.lead, warmed=(of.drift, of.drift))
        for name, of in (("film", FILM_SHEETS), ("coated", COATED_SHEETS))
    ),
)


def measure(row: Row, skins: int) -> list[str]:
    """Return the cells of one row."""
    plant, base = SHEETS[NAME], electronics(NAME)[ELECTRIC]
    exact_field = FieldContacts()
    errors, inside, certain, names = [], [], [], Counter[str]()
    moment = np.arange(FRAME_COUNT + TAIL_COUNT)
    for seed in range(skins):
        rng = random.Random(f"{row.name} {seed}")
        noise = np.random.default_rng(seed)
        circuit, sheets = _specimen(row, seed, rng, base, exact_field)
        sitting = Sitting(plant, circuit, np.zeros((0, 10)), np.zeros((0, 0, 10)), tolerance=row.told)
        sensor = sitting.sensor()
        places = [_places(sensor, rng, row.speed) for _ in range(PLACE_COUNT)]
        still = np.array(sheets.admittances(sensor, [[]])[0])
        intact = np.array(exact_field.admittances(sensor, [[]])[0])
        learned = intact if row.late else still
        change = row.change or (lambda exact, *_: exact)
        quiet = change(np.repeat(circuit.exact(learned)[None], LEARNED_FRAMES, 0), random.Random(seed), circuit)
        sitting.untouched = circuit.counts(quiet, 1, noise)[:, 0]
        touches = np.array([_touch(sheets, sensor, way, rng, row, still) for way in places])
        frames = change(circuit.exact(touches), random.Random(seed), circuit)
        sitting.touches = circuit.counts(frames, 1, noise)[:, :, 0]
        if row.peeled and not row.late:
            whole = circuit.counts(np.repeat(circuit.exact(intact)[None], LEARNED_FRAMES, 0), 1, noise)
            drawn = (float(np.mean(whole[:, 0, k] / whole[:, 0, 9])) for k in (5, 8))
            ohms = sensor.sheet_ohms(*FrameInversion(sensor).untouched(*drawn))
            names[_doctor(replace(sensor, known_ohms=ohms), sitting.untouched)] += PLACE_COUNT
            sitting.known = ohms if row.commissioned else ()
        try:
            said = decode(sitting)
        except RuntimeError as error:
            names[str(error)] += PLACE_COUNT
            certain += [False] * PLACE_COUNT
            continue
        names.update(name.partition(", or")[0] for name in said["named"] if name)
        for k, way in enumerate(places):
            at = way[np.minimum(moment, FRAME_COUNT - 1)]
            du = said["u"][k] - at[:, 0]
            ds = sensor.frustum.radius1 * (said["phi"][k] - at[:, 1])
            uu, us, ss = said["uu"][k], said["us"][k], said["ss"][k]
            square = (ss * du**2 - 2.0 * us * du * ds + uu * ds**2) / (uu * ss - us * us)
            known = np.isfinite(square) & (moment >= FIRST_FRAME) & (moment < FRAME_COUNT)
            inside += (square[known] < ELLIPSE_CHI2).tolist()
            valid = said["valid"][k] & (moment < FRAME_COUNT)
            certain.append(bool(valid.any()))
            errors += (1e3 * np.hypot(du, ds)[valid]).tolist()
    off = f"{quantile(errors, 0.5):.2f}/{quantile(errors, 0.95):.2f}"
    held = f"{np.mean(inside):.3f}" if inside else "-"
    told = [f"{name} {count / len(certain):.2f}" for name, count in names.most_common(2)]
    return [row.name, off, held, f"{np.mean(certain):.2f}", ", ".join(told) or "-"]


def _doctor(sensor: Sensor, now: np.ndarray) -> str:
    """Return what coneskin doctor names of a sensor whose untouched sheets are known."""
    seen = SkinStatistics(0.0)
    for number, counts in enumerate(now.tolist()):
        seen.add(FRAME_PERIOD * number, packet(number, counts))
    found = examine_sensor(sensor, seen.sensors[0, 0], 0.0, 0.1)
    (named,) = (one for one in found if one.item.endswith("sheets"))
    return f"doctor: {named.remedy.partition(',')[0] or 'nothing'}"


def _specimen(
    row: Row, seed: int, rng: random.Random, base: ConverterPlant, exact_field: FieldContacts
) -> tuple[ConverterPlant, _BuiltSheets | FieldContacts]:
    """Draw a skin."""
    circuit = replace(base, leads=tuple(1.0 + abs(rng.gauss(0.0, row.leads)) for _ in range(4)))
    flaws = _draw_flaws(row.sheets, seed)
    if row.peeled:
        flaws = replace(flaws[0], peeled=row.peeled), flaws[1]
    ideal = flaws == (_SheetFlaws(seed=flaws[0].seed), _SheetFlaws(seed=flaws[1].seed))
    return circuit, exact_field if ideal else _BuiltSheets(flaws, exact_field)


class Knowledge:
    """Fisher information of the counts of nine touches, one at each mark, and of the untouched sensor before them."""

    def __init__(self) -> None:
        self.base, self.field = electronics(NAME)[ELECTRIC], FieldContacts()
        self.sensor = Sitting(SHEETS[NAME], self.base, np.zeros((0, 10)), np.zeros((0, 0, 10))).sensor()
        marks = (mark.place for mark in _calibration_marks(self.sensor))
        self.marks = [LayerContact(*place, 2e-3, 5e-3, 5e-3) for place in marks]
        self.ideal = self.admittances(self.field)
        self.exact = self.base.exact(self.ideal)
        turn = 0.2 * STEP / self.sensor.frustum.radius1
        contacts = (
            (0.2 * STEP, lambda c: c._replace(u=c.u + 0.2 * STEP)),
            (0.2 * STEP, lambda c: c._replace(phi=c.phi + turn)),
            (STEP, lambda c: c._replace(radius=c.radius * (1.0 + STEP), reach=c.reach * (1.0 + STEP))),
            (STEP, lambda c: c._replace(conductance=c.conductance * (1.0 + STEP))),
        )
        # each touch has its own; the supply of each scene is measured with it
        self.own = [(self.moved(self.sensor, move) - self.exact) / size for size, move in contacts]
        self.own.append(self.exact)
        grown = {name: getattr(self.sensor, name) * (1.0 + STEP) for name in ("upper_sheet_ohms", "lower_sheet_ohms")}
        sheets = (replace(self.sensor, **{name: value}) for name, value in grown.items())
        self.shared = [(self.moved(made, lambda c: c) - self.exact) / STEP for made in sheets]

    def admittances(self, sheets: _BuiltSheets | FieldContacts) -> np.ndarray:
        """Return Y untouched, and touched at each mark."""
        return np.array(sheets.admittances(self.sensor, [[], *([mark] for mark in self.marks)]))

    def moved(self, sensor: Sensor, move: Callable[[LayerContact], LayerContact]) -> np.ndarray:
        """Return the exact counts with other contacts, or of other sheets."""
        scenes: list[list[LayerContact]] = [[], *([move(mark)] for mark in self.marks)]
        return self.base.exact(np.array(self.field.admittances(sensor, scenes)))

    def effect(self, row: Row, seed: int) -> np.ndarray:
        """Return what an effect of its usual size adds to the counts."""
        rng = random.Random(f"{row.name} {seed}")
        circuit, sheets = _specimen(row, seed, rng, self.base, self.field)
        upper, lower = row.warmed[0] + sum(row.stepped) / 2.0, row.warmed[1]
        warmed = self.ideal[0] * np.array([upper, upper, lower, lower])
        y = (self.ideal if sheets is self.field else self.admittances(sheets)) - warmed + leak_admittance(row.damp)
        exact = circuit.exact(y)
        return (row.change(exact, rng, circuit) if row.change else exact) - self.exact

    def deviation(self, effect: np.ndarray, place: float, ohms: float, after: bool) -> float:
        """Return the Cramer-Rao deviation of how much of an effect there is, over its size.

        Args:
            effect: what it adds to the counts.
            place: standard deviation of each touch's place [m].
            ohms: that of the sheets' resistances, a ratio.
            after: it comes after the untouched sensor was measured.
        """
        frames = np.array([0.0 if after else LEARNED_FRAMES, *[FRAME_COUNT] * len(self.marks)])
        columns = [effect, *self.shared]
        priors = [0.0, ohms**-2, ohms**-2]
        for k in range(len(frames)):
            alone = (np.arange(len(frames)) == k)[:, None]
            columns += [one * alone for one in self.own]
            priors += [place**-2, place**-2, RADIUS_ERROR**-2, SIEMENS_ERROR**-2, 1.0]
        slopes = np.array([(np.sqrt(frames)[:, None] * one).ravel() for one in columns])
        information = slopes @ slopes.T / (self.base.noise**2 + 1.0 / 12.0) + np.diag(priors)
        unit = np.sqrt(np.maximum(np.diag(information), 1e-30))
        scaled = np.linalg.pinv(information / np.outer(unit, unit), rcond=1e-14, hermitian=True)
        return float(math.sqrt(scaled[0, 0]) / unit[0])

    def cells(self, row: Row) -> list[str]:
        """Return the cells of a row."""
        after = bool(row.late or row.damp or max(*row.warmed, *row.stepped) > 0.0)
        effects = [self.effect(row, seed) for seed in range(KNOWN_SKINS)]
        found = [
            sorted(self.deviation(one, place, ohms, after) for one in effects)[KNOWN_SKINS // 2]
            for place, ohms in ((PLACE_ERROR, MAKERS_OHMS), (PLACE_ERROR, KNOWN_OHMS), (MARK_ERROR, KNOWN_OHMS))
        ]
        by = ("by touches", "with the sheets' ohms", "with marks too", "not at all")
        return [row.name, *(f"{one:.2g}" for one in found), by[next((k for k in range(3) if found[k] < SHOWN), 3)]]


def _places(sensor: Sensor, rng: random.Random, speed: float) -> np.ndarray:
    """Return u [m] and phi [rad] of a contact frame after frame."""
    cone = sensor.frustum
    turn, way = rng.uniform(0.0, 2.0 * math.pi), speed * FRAME_PERIOD * np.arange(FRAME_COUNT)
    room, edge = 0.012 + 0.5 * way[-1] * abs(math.cos(turn)), 0.012 + 0.5 * way[-1] * abs(math.sin(turn))
    u = rng.uniform(room, cone.slant - room) + (way - 0.5 * way[-1]) * math.cos(turn)
    s = rng.uniform(edge, cone.wrap * cone.radius1 - edge) + (way - 0.5 * way[-1]) * math.sin(turn)
    return np.stack([u, s / cone.radius1], axis=1)


def _touch(
    sheets: _BuiltSheets | FieldContacts, sensor: Sensor, way: np.ndarray, rng: random.Random, row: Row, still: Frames
) -> np.ndarray:
    """Return Y frame by frame [S]."""
    radius, siemens = rng.uniform(0.003, 0.008), math.exp(rng.uniform(math.log(7e-4), math.log(3e-3)))
    contacts = [[LayerContact(u, phi, siemens, radius, radius)] for u, phi in way.tolist()]
    found = sheets.admittances(sensor, contacts if row.speed else contacts[:1])
    y = np.array([*(found if row.speed else found * FRAME_COUNT), *[still] * TAIL_COUNT])
    warmed = [rng.gauss(0.0, row.warmed[0])] * 2 + [rng.gauss(0.0, row.warmed[1])] * 2
    step = rng.uniform(*row.stepped) * rng.choice((-1.0, 1.0))
    warmed[:2] = warmed[0] + step, warmed[0] + step
    return np.asarray(y - still * np.array(warmed) + leak_admittance(row.damp))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skins", type=int, default=24, help="of each row (%(default)s)")
    parser.add_argument("--rows", default="", help="only those whose name begins so")
    args = parser.parse_args()
    print(head("numpy", "scipy"))
    rows = [measure(row, args.skins) for row in ROWS if row.name.startswith(args.rows)]
    columns = ["effect", "certain places off, median/95 % [mm]", "in ellipse", "certain", "named, share of touches"]
    show(f"skins as they are built, {NAME}, {ELECTRIC}", columns, rows)
    knowledge, still = Knowledge(), ("ideal", "20 mV", "film, all", "coated, all")
    known = [knowledge.cells(row) for row in ROWS if row.name.startswith(args.rows) and not row.name.startswith(still)]
    columns = ["effect", "place unknown", "and ohms known", "and places known to 0.3 mm", "it can be known"]
    show("Cramer-Rao deviation of an effect from nine touches, over its size", columns, known)
