"""``coneskin permissible``: how fast which part of a skinned arm may move, by the limits of whoever uses it.

example:
  coneskin permissible scene.toml --limits limits.toml -o impact.toml --picture impact.png

The scene needs an [arm], skins and their [padding]; with a [motion] the speeds are those of its joint positions. The
limits are yours: docs/do/permissible-speed.md lists the keys. A scene whose [arm] has speed_limit_from = "impact.toml"
lets the guard keep the speeds. A model with assumed servos; no safety assessment.

Exit code: 0; 1 where no speed keeps the limits, or a file has a mistake.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import SceneError
from coneskin.core.text import finite

from .terminal import print_hint

if TYPE_CHECKING:
    from coneskin.impact.permissible_speed.speed_map import SpeedMap


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    add("--limits", type=Path, required=True, metavar="FILE", help="limits of the force, and how the arm stops")
    add("-o", "--output", type=Path, metavar="FILE", help="write the speeds as TOML for speed_limit_from")
    add("--picture", type=Path, metavar="FILE", help="draw them (png, svg, pdf; extra pictures)")
    add("--any-position", action="store_true", help="let the arm be anywhere, also where the scene has a [motion]")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Compute, print and write the speeds."""
    from coneskin.impact.permissible_speed.limits_file import read_limits
    from coneskin.impact.permissible_speed.speed_map import map_speeds, write_map
    from coneskin.scene.reader import load_scene

    limits = read_limits(args.limits)
    scene = load_scene(args.scene)
    if args.output is not None and not args.output.absolute().parent.is_dir():
        raise SceneError(
            [f"{args.output} cannot be written: there is no folder {args.output.parent}"], args.output.name
        )

    def note(text: str) -> None:
        if sys.stderr.isatty():
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)

    found = map_speeds(scene, limits, any_position=args.any_position, note=note)
    note("")
    if args.output is not None:
        write_map(found, args.output)
    if args.picture is not None:
        from coneskin.impact.permissible_speed.map_picture import draw_map

        draw_map(scene, limits, found, args.picture)
    if args.json:
        print(json.dumps(_plain(found)))
    else:
        _print(found, args, limits.measured.deceleration)
    return 0


def _plain(found: SpeedMap) -> dict[str, Any]:
    """Return a map for JSON: the table of the file, with the heaviest mass at each patch."""
    from coneskin.impact.permissible_speed.speed_map import map_table

    table: dict[str, Any] = map_table(found)["speed_limit"]
    del table["digest"]  # of the file; this has more
    for row, patch, mass in zip(table["patch"], found.patches, found.masses, strict=True):
        row["link"] = patch.link
        row["mass_kg"] = finite(mass)
        row["point_mm"] = [1e3 * value for value in patch.point]
        row["normal"] = list(patch.normal)
    return table


def _print(found: SpeedMap, args: argparse.Namespace, measured: float) -> None:
    table = found.table
    print(f"limits: {table.edition}; transcribed by {table.transcribed_by}, verified by {table.verified_by}")
    print(
        f"the arm brakes {1e3 * table.reaction:g} ms after the layers close, with {table.deceleration:g} rad/s2 "
        f"({table.measured_by})"
    )
    if table.deceleration < measured:
        print(f"its motors hold no more there with its payload; {measured:g} rad/s2 were measured")
    where = "in the positions of the motion" if table.lowest else "in any position"
    print(f"permissible speed of a surface along its normal [m/s], {where}, over its lever [m/rad]:")
    print(f"{'sensor':20}{'limited by':>16}" + "".join(f"{lever:>8g}" for lever in table.levers))
    for name in dict.fromkeys(patch.sensor for patch in table.patches):
        numbers = {patch.curve for patch in table.patches if patch.sensor == name}
        slowest = min(numbers, key=lambda number: found.curves[number].speeds)
        fastest = max(numbers, key=lambda number: found.curves[number].speeds)
        for what, number in (("slowest", slowest), ("fastest", fastest))[: 1 + (fastest != slowest)]:
            curve = found.curves[number]
            cells = "".join(f"{speed:>8.3f}" for speed in curve.speeds)
            print(f"{f'{name}, {what}':20}{curve.region[:15]:>16}{cells}")
    extras = [found.curves[patch.curve].extra for patch in table.patches]
    lag, bend = max(extra.lag for extra in extras), max(extra.bend for extra in extras)
    print(
        f"with what a surface goes beyond a straight way, at worst: {lag:.2g} m/rad by the lag of other joints, "
        f"{bend:.2g} m/rad2 by turning"
    )
    if args.output is not None:
        name = Path(os.path.relpath(args.output.resolve(), args.scene.resolve().parent)).as_posix()
        value = json.dumps(name, ensure_ascii=False)  # a string of TOML, too
        print(f"{args.output}: name it in the [arm] of the scene: speed_limit_from = {value}")
    print("A model with assumed servos and your values: measure on the real arm. No safety assessment.")
    scene = shlex.quote(str(args.scene))
    if args.output is not None:
        print_hint(f"next, once the scene names it: coneskin doctor {scene} --check")
    else:
        limits = shlex.quote(str(args.limits))
        print_hint(f"next: coneskin permissible {scene} --limits {limits} -o impact.toml")
