"""``coneskin calibrate``: known places of a skin are touched, and what it reads wrongly is taken off from then on.

example:
  coneskin calibrate scene.toml --by "A. Person"     touch each mark as it is named; "n" and Enter: out of reach
  coneskin calibrate scene.toml --list
  coneskin calibrate scene.toml --simulated --skin as_built.toml --picture residuals.png

Touch with something narrow and blunt, such as the rounded end of a rod of 5 mm. Nothing guards the arm meanwhile, and
nothing here moves it. The result is added to calibrations/device-<device>.json beside the scene, or to what the sensor
names as its calibration; it applies once the sensor's table has `calibration = "calibrations"`. A commissioning made
with another calibration is void. Exit code: 0 all sensors are calibrated, 1 not all, or not carried out.
"""

from __future__ import annotations

import argparse
import json
import math
import tomllib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError

from .terminal import TouchTerminal, add_touch_options

if TYPE_CHECKING:
    from coneskin.commissioning.calibration.calibrate import CalibrationResult

_DEFAULT_FOLDER = "calibrations"
_UNEVEN_MM = 2.0  # rms of what a map leaves of a touch; of a film of its class it is 0.7, and 1.2 with four marks
_ERROR_HELP = "standard deviation with which marks are placed and touched, along and around (default: 0.3)"
_FORCES_HELP = "then press three of the marks with these known forces [N], e.g. 1,2,5,10, for touch_force_n"
_MARKS_HELP = "marks on each sensor, to be measured (default: those that its design has printed on the cover, else 9)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add_touch_options(parser, "residuals")
    add = parser.add_argument
    add("--marks", type=int, choices=(4, 9, 16), default=0, help=_MARKS_HELP)
    add("--mark-error-mm", type=_mark_error, default=0.3, metavar="MM", help=_ERROR_HELP)
    add("--forces", type=_forces, default=(), metavar="N,N,...", help=_FORCES_HELP)
    add("--skin", type=Path, metavar="SCENE", help="with --simulated: scene that says how the virtual skin was built")


def _mark_error(text: str) -> float:
    value = float(text)
    if not 0.01 <= value <= 20.0:
        raise argparse.ArgumentTypeError(f"must be from 0.01 to 20 mm, got {text}")
    return value


def _forces(text: str) -> tuple[float, ...]:
    values = tuple(sorted({float(word) for word in text.split(",")}))
    if len(values) < 2 or not (values[0] >= 0.05 and values[-1] <= 1000.0):
        raise argparse.ArgumentTypeError(f"must be two or more forces from 0.05 to 1000 N, got {text}")
    return values


def run(args: argparse.Namespace) -> int:
    """Calibrate the skin of a scene, or list its marks."""
    from coneskin.commissioning.calibration.calibrate import Calibrator
    from coneskin.commissioning.skin_watch import TouchSession, check_touchable
    from coneskin.scene.reader import load_scene
    from coneskin.scene.tables.sensor_tables import named_files
    from coneskin.skin.sources.kinds import is_simulated

    scene = load_scene(args.scene, calibrated=False)
    tables = tomllib.loads(args.scene.read_text(encoding="utf-8-sig"))
    if args.skin and not args.simulated:
        raise SceneError(["--skin says how a virtual skin was built: give --simulated too"], scene.name)
    built = load_scene(args.skin, calibrated=False) if args.skin else None
    names, others = ({one.sensor.name for one in each.sensors} for each in (scene, built or scene))
    if built is not None and names != others:
        said = f"{', '.join(sorted(names))}, got {', '.join(sorted(others)) or 'none'}"
        raise SceneError([f"--skin must have the sensors of {scene.name}: {said}"], built.name)
    simulated = args.simulated or (args.list and scene.source is not None and is_simulated(scene.source.kind))
    check_touchable(scene, simulated)  # before the terminal is read
    terminal = TouchTerminal(args)
    calibrator = Calibrator(
        TouchSession(scene, terminal.notice, terminal.reading, terminal.refuses, simulated, built),
        args.marks,
        1e-3 * args.mark_error_mm,
        args.forces,
        named_files(tables, scene.folder, "file"),
    )
    if args.list:
        terminal.list_marks((item.sensor.name, mark) for item in calibrator.sensors for mark in item.marks)
        return 0
    if not args.json:
        print("coneskin calibrate: the arm stands, and nothing guards it. Touch each mark with something narrow and")
        print('blunt, and hold it until it is read. "n" and Enter: out of reach. Ctrl-C ends it.', flush=True)
    results = calibrator.run(args.by)
    if args.picture:
        from coneskin.commissioning.calibration.residuals_picture import draw_residuals

        draw_residuals(results, args.picture)
    _write(results, named_files(tables, scene.folder, "calibration"), scene.folder / _DEFAULT_FOLDER, args.json)
    return 0 if all(result.record for result in results) else 1


def _write(results: list[CalibrationResult], named: list[Path | None], default: Path, as_json: bool) -> None:
    """Add the results to the files of their devices, and show them."""
    from coneskin.scene.values.calibration_file import add_calibration, calibration_path

    for result, place in zip(results, named, strict=True):
        path = None
        if result.record is not None:
            device = result.touches.sensor.device_id
            path = calibration_path(place or default, device)
            add_calibration(path, device, result.record)
        _show(result, path, place is None, as_json)


def _show(result: CalibrationResult, path: Path | None, unnamed: bool, as_json: bool) -> None:
    record, name = result.record, result.touches.sensor.name
    line = {"kind": "end", "sensor": name, "calibrated": record is not None, "cause": result.refusal}
    if record is None:
        print(json.dumps(line) if as_json else f"NOT calibrated: {result.refusal}", flush=True)
        return
    used, uneven = sum(touch.used for touch in record.touches), record.after_rms_mm > _UNEVEN_MM
    if as_json:
        line |= {"file": str(path), "touches": len(record.touches), "used": used, "uneven": uneven}
        print(json.dumps({**asdict(record), **line}), flush=True)
        return
    leads = ", ".join(f"{letter} {ohm:+.1f}" for letter, ohm in zip("ABCD", record.extra_ohm, strict=True))
    leads += " ohm more than lead_ohm, if it is leads"
    own = result.touches.sensor.electronics.lead_ohms
    if any(more + ohm < 0.0 for more, ohm in zip(record.extra_ohm, own, strict=True)):
        leads = "it is not leads alone: one would have less than 0 ohm"
    print(f"{name}: {len(record.touches)} touches, {used} used")
    print(f"  before      {record.before_rms_mm:.2f} mm (rms), {record.before_largest_mm:.2f} mm at most")
    print(
        f"  calibrated  {record.after_rms_mm:.2f} mm (rms), {record.after_largest_mm:.2f} mm at most, cross-validated; "
        "it holds how well the marks were placed and touched"
    )
    if uneven:
        print(f"  uneven      {_UNEVEN_MM:g} mm is much: the sheet is not even, or marks were missed. Take --marks 16,")
        print('              write sheet_class = "coated", or build with another sheet, and calibrate again')
    print(
        f"  fitted      along: {record.fitted_along}; around: {record.fitted_around}; {record.map_error_mm:.2f} mm "
        "along and around each is left at other places (rms)"
    )
    if result.fit is not None:
        place = result.fit.next_mark
        more = "enough marks; one more" if result.fit.enough else "too few: touch one more,"
        print(f"  next        {more} at {1e3 * place.u:.0f} mm, {math.degrees(place.phi):.0f} deg would tell most")
    print(f"  as leads    {leads}")
    print(f"  sheets      {record.sheet_ohm[0]:.0f} and {record.sheet_ohm[1]:.0f} ohm per square, by their currents")
    if record.forces_n:
        pairs = ", ".join(f"{n:g} N {x:.2f}" for n, x in zip(record.forces_n, record.force_levels, strict=True))
        print(f"  forces      level of {pairs}; a force that is read is known to {100.0 * record.force_error:.0f} %")
    hint = f'; it applies once the table of {name} has calibration = "{_DEFAULT_FOLDER}"' if unnamed else ""
    print(f"written to {path}{hint}; commission the skin again")
