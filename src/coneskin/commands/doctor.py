"""``coneskin doctor``: examine the skin, the wires and the arm of a scene; each finding comes with its remedy.

example:
  coneskin doctor scene.toml                 the skin untouched, then touched near A, B, C and D; then the arm
  coneskin doctor scene.toml --check         read the scene, list what is in it, open and start nothing
  coneskin doctor scene.toml --no-touches    nobody touches: what untouched frames and the controller say
  coneskin doctor scene.toml --simulated     a virtual skin is touched by the command, the arm is simulated

Nothing is moved, and nothing is guarded. What is not there is not tried, and said to be. Where exchanged wires can be
mended by the scene, the change is shown and made after a "y" (--yes makes it unasked). Exit code: 0 nothing is bad, 1
something is, or was mended: run it again. With --check: 0 a guard can start with this scene, 1 it has mistakes, lacks
something, or --measured shows what is bad. Without a valid commissioning record it is 0 too: the arm then only stops.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import shlex
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError
from coneskin.core.text import painted

from .simulated_arm import simulated_arm
from .terminal import print_hint

if TYPE_CHECKING:
    from coneskin.commissioning.examination.examination import Doctor
    from coneskin.core.finding import Finding
    from coneskin.scene.values.scene import Scene

_HOLD_UP_TIME = 10.0  # s
_VERDICT_COLORS = {"ok": "green", "warning": "yellow", "bad": "red", "not tried": "blue"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    add("--check", action="store_true", help="list what is in the scene; open and start nothing")
    add("--simulated", action="store_true", help="start a simulated controller at the scene's host")
    add("--no-touches", action="store_true", help="ask for no touches: the wires are not tried")
    help_text = "compare the scene with what scripts/measure_controller.py has seen"
    add("--measured", type=Path, metavar="FILE", help=help_text)
    add("--yes", action="store_true", help="make the changes of the scene without asking")
    add("--json", action="store_true", help="print each finding as a JSON object, one per line")


def run(args: argparse.Namespace) -> int:
    """Examine a scene."""
    from coneskin.scene.commissioning_record import with_commissioning
    from coneskin.scene.reader import load_scene

    scene = with_commissioning(load_scene(args.scene), time.time())
    measured: list[Finding] = []

    def tell(finding: Finding) -> None:
        verdict = painted(finding.verdict, _VERDICT_COLORS[finding.verdict], sys.stdout)
        said = finding.text.replace(finding.verdict, verdict, 1)
        print(json.dumps(asdict(finding)) if args.json else said, flush=True)

    if args.measured:
        from coneskin.robot.ur.measured import compare, read_measured

        limits, hz = scene.monitoring_limits, scene.arm.watchdog_hz if scene.arm else math.inf
        measured += compare(read_measured(args.measured), limits.escalate, limits.stop_budget, hz)
    if args.check:
        for finding in measured:
            tell(finding)
        return max(_check(scene, args.json), *(int(finding.verdict == "bad") for finding in measured), 0)
    from coneskin.commissioning.examination.examination import Doctor

    def ask(words: str) -> None:
        print(f"       >>  {words}", file=sys.stderr, flush=True)

    doctor = Doctor(scene, tell, ask, not args.no_touches, hold_up_time=_HOLD_UP_TIME)
    doctor.note(*measured)
    with simulated_arm(scene) if args.simulated and scene.arm else contextlib.nullcontext():
        doctor.examine()
    code = 1 if any(finding.verdict == "bad" for finding in doctor.findings) else 0
    if doctor.patches:
        _offer_patch(args, scene, doctor)
    elif not args.json:
        _say_next(args, scene, code)
    return code


def _check(scene: Scene, as_json: bool) -> int:
    """List what is in a scene; return 1 where a guard would refuse it."""
    from coneskin.scene.build import place_on_arm
    from coneskin.scene.summary import missing_parts, summarize
    from coneskin.scene.suspicions import suspicions
    from coneskin.skin.sources.kinds import is_simulated

    if any(link.mesh for link in scene.links):
        place_on_arm(scene)  # reads them, as a guard would
    found, missing, doubts = summarize(scene), missing_parts(scene), [one.line for one in suspicions(scene)]
    if as_json:
        lacks = {"cannot_be_guarded_yet": missing} if missing else {}
        print(json.dumps({**found, **lacks, **({"warnings": doubts} if doubts else {})}))
    else:
        width = max(map(len, found))
        print("\n".join(f"{key:<{width}}  {value}" for key, value in found.items()))
        if scene.commissioning and not scene.commissioning.valid:
            named = scene.name + (" --simulated" if scene.source and is_simulated(scene.source.kind) else "")
            print(f"the arm will only stop when it is touched; to let it move away: coneskin commission {named}")
    for line in doubts:
        print(f"warning: {line}", file=sys.stderr)
    for line in missing:
        print(f"coneskin doctor: {scene.name} cannot be guarded yet: {line}", file=sys.stderr)
    return 1 if missing else 0


def _offer_patch(args: argparse.Namespace, scene: Scene, doctor: Doctor) -> None:
    """Show what would mend the scene, and write it where a person agrees.

    Raises:
        SceneError: the scene is written in a way in which it cannot be changed, or cannot be written.
    """
    from coneskin.commissioning.examination.examination import diff_texts, set_sensor_keys
    from coneskin.core.files import explain_os_error, write_whole
    from coneskin.scene.reader import parse_scene

    old = args.scene.read_text(encoding="utf-8")
    names, text = [item.sensor.name for item in scene.sensors], old
    for patch in doctor.patches:
        text = set_sensor_keys(text, names.index(patch.sensor), patch.keys)
    parse_scene(text, scene.name, scene.folder)
    print(f"\n{diff_texts(old, text, str(args.scene))}", file=sys.stderr, flush=True)
    agreed = args.yes
    if not (args.yes or args.json):
        print("change the scene so? [y/N] ", end="", file=sys.stderr, flush=True)
        agreed = sys.stdin.readline().strip().lower() in ("y", "yes")
    if not agreed:
        print(f"coneskin doctor: {args.scene} was left as it is", file=sys.stderr)
        return
    with explain_os_error(lambda why: SceneError([why], str(args.scene)), "it cannot be written"):
        write_whole(args.scene, text)
    print(f"coneskin doctor: {args.scene} was changed; run it again", file=sys.stderr)


def _say_next(args: argparse.Namespace, scene: Scene, code: int) -> None:
    from coneskin.scene.build import withheld_motion

    name = shlex.quote(str(args.scene)) + (" --simulated" if args.simulated else "")
    if code:
        measured = f" --measured {shlex.quote(str(args.measured))}" if args.measured else ""
        print_hint(f"next: mend what is bad, then coneskin doctor {name}{measured}")
    elif withheld_motion(scene):
        print_hint(f"next: coneskin commission {name}")
    else:
        alone = scene.arm is None  # `guard --simulated` simulates an arm: a virtual skin alone needs no option
        print_hint(f"next: coneskin guard {shlex.quote(str(args.scene)) if alone else name}")
