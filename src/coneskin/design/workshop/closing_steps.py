"""Last steps of the build guide: the cable, and the tests of the sheet that is built."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign

from .build_figures import BuildFigures
from .guide_words import SPREAD, in_mm, in_ohms, side_name, tie_place

_MOUNT = 10e-3  # m; half of the mount of the cable tie

__all__ = ["cable_steps", "reading_lines", "test_steps"]


def cable_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    """Yield the steps from the tabs to the connector."""
    cable, plan = figures.cable, design.layout.plan
    if plan.tab:
        yield f"Fold the tabs over {side_name(plan.wires)} outwards along the green lines, away from the link."
    if plan.wires == "end2" and design.next_joint is not None:
        yield "The tabs would run into the next sheet there: bend them up before that sheet is wrapped."
    if plan.wires.startswith("edge"):
        between = (
            "between the edges before you close the wrap" if design.has_seam else "on the bare link beside that edge"
        )
        yield f"The tabs leave at {side_name(plan.wires)}: lead them out {between}."
    rooms = _rooms(figures)
    yield from _short_of_room(figures, rooms)
    ground = "there" if rooms.get(cable.side, math.inf) < cable.tie + _MOUNT else "on the link"
    yield (
        f"Glue the cable-tie mount {ground}, {in_mm(cable.tie)} beyond "
        f"{side_name(cable.side)}, at {tie_place(design, figures)}. "
        "Lead the four wires to it flat on the link, leave a loop of 20 mm so that no pull reaches a tab, and tie them "
        f"down. Crimp the connector {in_mm(cable.connector)} beyond the rim: pin 1 A (red), pin 2 B "
        "(black), pin 3 C (yellow), pin 4 D (green). *Check:* pull each wire as hard as 3 N behind the tie: nothing "
        "moves before it; and move the joint of the arm through its whole range by hand (freedrive): nothing is "
        "pinched or stretched."
    )


def _rooms(figures: BuildFigures) -> dict[str, float]:
    """Return how far the link goes on, with nothing of it in the way, beyond each end that has a mesh [m]."""
    place = figures.placement
    ends = (("end1", place.before, place.free[0]), ("end2", place.beyond, place.free[1]))
    return {end: min(room, free) for end, room, free in ends if room is not None}


def _short_of_room(figures: BuildFigures, rooms: dict[str, float]) -> Iterator[str]:
    """Yield what a person does where the link ends, or is in the way, before the place of tie or connector."""
    cable, place = figures.cable, figures.placement
    room = rooms.get(cable.side, math.inf)
    if room >= cable.connector:
        return
    other = "end2" if cable.side == "end1" else "end1"
    more = rooms.get(other, 0.0)
    if room == place.free[cable.side == "end2"]:  # the link goes on, but not clear of the cable
        yield (
            f"Another part of the link is in the way of the cable at edge 0, {in_mm(room)} beyond "
            f"{side_name(cable.side)}: design again with `--seam X Y Z`, a direction in which the link goes on clear "
            f"of it for {in_mm(cable.connector)}, or with a shorter `--connector-mm`; of a single sheet the wires can "
            f"leave at the other end, `--wires {other}`, where {in_mm(more)} are free."
        )
        return
    what = "connector lies" if room >= cable.tie + _MOUNT else "cable tie and the connector lie"
    yield (
        f"The link ends {in_mm(max(room, 0.0))} beyond {side_name(cable.side)}, so the {what} on what is bolted to the "
        "link there and moves with it, such as a flange or a cover; never on the far side of a joint. If nothing does, "
        + (
            f"design again with `--wires {other}`, where there are {in_mm(more)} of link"
            if more >= cable.tie + _MOUNT
            else "glue the mount on part 7, over the margin of that end, and let the connector hang from it"
        )
        + "."
    )


def test_steps(figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the steps that test the sheet that is built.

    Args:
        figures: for building it.
        folder: of its files, as a path in the folder of the design; "." for that folder itself.
    """
    sensor = "sensor.toml" if folder == "." else f"{folder}/sensor.toml"
    ab, cd = figures.pairs
    yield (
        f"Measure at the connector: pins 1-2 {in_ohms(ab.ohms)}, pins 3-4 {in_ohms(cd.ohms)}; pins 1-3 above 10 Mohm "
        "while nothing touches the sensor, and far less while a thumb presses its middle; again above 10 Mohm once it "
        "is lifted."
    )
    yield (
        f"Write the measured sheets into `{sensor}`: `upper_sheet_ohm` = reading 1-2 divided by "
        f"{ab.squares:.4f}, `lower_sheet_ohm` = reading 3-4 divided by {cd.squares:.4f}. *Check:* a sheet of exactly "
        f"{ab.sheet_ohms:g} and {cd.sheet_ohms:g} ohm per square gives {ab.ohms / ab.squares:.4g} and "
        f"{cd.ohms / cd.squares:.4g}, less than its own, for what lies beside the active area conducts too; yours "
        f"differ from these as the strips did, and by {SPREAD:.0%} at most."
    )
    yield (
        "Plug it into the board (`coneskin firmware` writes sketch, wiring and parts) and run `coneskin monitor "
        "PORT`: the "
        "untouched frame must read as in the table below, within 3 % once the measured sheets are in the sensor file."
    )
    yield (
        "Write the scene (`coneskin init`), and let `coneskin commission` read where a person touches the marks that "
        "it asks for: it finds a turned, mirrored or exchanged sheet. Until then the arm only stops at a touch, and "
        "does not retreat."
    )


def reading_lines(figures: BuildFigures) -> Iterator[str]:
    """Yield the tables of what a multimeter and ``coneskin monitor`` should read."""
    yield "| between | multimeter | for a material of |"
    yield "|---|---|---|"
    for pair in figures.pairs:
        yield f"| {pair.pair} | {in_ohms(pair.ohms)} | {pair.sheet_ohms:g} ohm per square |"
    yield "| A or B to C or D | above 10 Mohm, untouched | |"
    yield ""
    yield "Untouched frame, in counts, as `coneskin monitor` shows it with the sensor file of this design:"
    yield ""
    yield "| phase | " + " | ".join(name for name in figures.frame) + " |"
    yield "|---" * (len(figures.frame) + 1) + "|"
    yield "| counts | " + " | ".join(str(count) for count in figures.frame.values()) + " |"
    ab, cd = figures.pairs
    radial, angular = ab.ohms / (ab.squares * ab.sheet_ohms), cd.ohms / (cd.squares * cd.sheet_ohms)
    yield ""
    yield (
        "The model of the sensor ends at its electrodes, the sheets do not: until the measured sheets are in the file, "
        f"radial_current reads {1.0 / radial:.0%} and angular_current {1.0 / angular:.0%} of these."
    )
