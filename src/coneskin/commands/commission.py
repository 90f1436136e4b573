"""``coneskin commission``: a person touches marks on a skin, and the skin must read them where they are.

example:
  coneskin commission scene.toml --by "A. Person"    touch each mark as it is named; "n" and Enter: out of reach
  coneskin commission scene.toml --list --picture marks.png
  coneskin commission scene.toml --simulated         a virtual skin, which is touched by the command itself

The arm stands: nothing here moves it, and nothing guards it either. The result is written beside the scene, as
scene.commissioning.json. Without one that has passed, `coneskin guard` only stops the arm where the scene lets it
retreat or comply. Ctrl-C writes nothing. Exit code: 0 passed, 1 not passed, or not carried out.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .terminal import TouchTerminal, add_touch_options

if TYPE_CHECKING:
    from coneskin.commissioning.acceptance.procedure import Procedure


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add_touch_options(parser, "marks")
    help_text = "joint positions [deg] for which the marks are described (default: the controller is asked)"
    parser.add_argument("--posture-deg", type=_posture, metavar="Q1,...,Q6", help=help_text)


def _posture(text: str) -> tuple[float, ...]:
    try:
        values = tuple(math.radians(float(part)) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 6 or not all(map(math.isfinite, values)):
        raise argparse.ArgumentTypeError(f"must be six angles in degrees with commas between, got {text!r}")
    return values


def run(args: argparse.Namespace) -> int:
    """Commission the skin of a scene, or list its marks."""
    from coneskin.commissioning.acceptance.commission import Commissioner
    from coneskin.commissioning.skin_watch import TouchSession
    from coneskin.scene.build import bare_parts
    from coneskin.scene.commissioning_record import write_record
    from coneskin.scene.reader import load_scene

    scene = load_scene(args.scene)
    terminal = TouchTerminal(args)
    session = TouchSession(scene, terminal.notice, terminal.reading, terminal.refuses, args.simulated)
    commissioner = Commissioner(session, args.posture_deg)

    def begin(procedure: Procedure, q: Sequence[float] | None) -> None:
        if args.picture:
            from coneskin.commissioning.acceptance.marks_picture import draw_marks

            draw_marks(scene, procedure, q, args.picture)

    if args.list:
        procedure, q = commissioner.plan()
        begin(procedure, q)
        terminal.list_marks((item.sensor.name, mark) for item in procedure.sensors for mark in item.plan)
        return 0
    if not args.json:
        print("coneskin commission: the arm stands, and nothing guards it. Touch each mark with one finger, firmly,")
        print('and hold it until it is read. "n" and Enter: out of reach, name another. Ctrl-C ends it.', flush=True)
    record = commissioner.run(args.by, begin)
    path = write_record(scene, record)
    bare = bare_parts(scene)
    facts = {"kind": "end", "passed": record.passed, "cause": record.cause, "record": str(path), "no_skin_on": bare}
    said = "passed: the arm may move away from touches" if record.passed else "NOT passed: the arm only stops"
    if record.passed and bare:
        said += f", unless what has no skin would lead (all or a part of {bare}); bare_side in [reaction] decides that"
    print(json.dumps(facts) if args.json else f"{terminal.clear()}{said}; written to {path}")
    return 0 if record.passed else 1
