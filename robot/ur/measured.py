"""What scripts/measure_controller.py has measured on one controller: read from its file, and compared with a scene.

A guard assumes that a stop shows within ``escalate_ms`` (a program that arrives ends the one that moves the arm), that
the arm brakes as it is told, and that the watchdog ends a program soon after its period. Else findings name the key.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from coneskin.core.errors import RobotRefused
from coneskin.core.files import read_file
from coneskin.core.finding import Finding, Verdict
from coneskin.core.text import read_json
from coneskin.robot.driver.liveness import MAX_ESCALATE

_MAX_SIZE = 1 << 20  # bytes
_LIMIT_MARGIN = 1.2  # times what was measured, for a limit that shall hold
MEASURED_DECELERATION = 10.0  #: rad/s2 of the stops by program that the script measures
_WATCHDOG_LATENESS = 0.02  # s, that the simulated controller's never reaches
_WATCHDOG_TIME = 0.25  # s; 1 / watchdog_hz, by default
_MOST_HZ = 20.0  # of a watchdog, which a guard's heartbeat keeps alive on a busy computer


@dataclass(frozen=True, slots=True)
class _MeasuredController:
    """Times of one controller."""

    what: str  #: model, version and date
    start: tuple[float, float]  #: p50 and p95 of a program's last byte to its first cycle [s]
    #: p50 and worst of the time from the end of a watchdog's period to the end of the program [s]
    watchdog: tuple[float, float]
    deceleration: float  #: of the leading joint, where a program is ended [rad/s2]; 0 where it was not measured
    #: path, motion, speed [rad/s] and worst time until the arm stood [s], of each kind of stop of a joint
    stops: tuple[tuple[str, str, float, float], ...]
    shows: float  #: worst time until a stop by program or command showed [s]; without one by program, its start counts


def read_measured(path: Path) -> _MeasuredController:
    """Read the file of scripts/measure_controller.py.

    Raises:
        RobotRefused: it cannot be read, or is not one.
    """
    try:
        facts: Any = read_json(read_file(path, _MAX_SIZE))
        joints = [stop for stop in facts["stops"] if stop["joint"] is not None]
        ended = [stop for stop in joints if stop["path"] == "command"]
        ways = [stop["way_rad"]["p50"] - stop["speed"] * stop["slows_s"]["p50"] for stop in ended]
        rates = [stop["speed"] ** 2 / (2.0 * way) for stop, way in zip(ended, ways, strict=True) if way > 0.0]
        shows = [float(stop["slows_s"]["worst"]) for stop in joints if stop["path"] != "slider"]
        if all(stop["path"] != "program" for stop in joints):
            shows.append(float(facts["start_s"]["p95"]))
        found = _MeasuredController(
            f"{facts['model']}, {facts['version']}, {facts['date']}",
            (float(facts["start_s"]["p50"]), float(facts["start_s"]["p95"])),
            (float(facts["watchdog_s"]["p50"]), float(facts["watchdog_s"]["worst"])),
            float(median(rates)) if rates else 0.0,
            tuple((s["path"], s["motion"], float(s["speed"]), float(s["stands_s"]["worst"])) for s in joints),
            max(shows),
        )
    except (OSError, ValueError, KeyError, TypeError) as exc:
        raise RobotRefused(
            f"{path} is no file of scripts/measure_controller.py: {type(exc).__name__}: {exc}; measure again"
        ) from exc
    if not all(map(math.isfinite, (*found.start, *found.watchdog, found.deceleration, found.shows))):
        raise RobotRefused(f"{path} has times that are not finite; measure again")
    return found


def compare(
    measured: _MeasuredController, escalate: float, stop_budget: Callable[[float, float], float], watchdog_hz: float
) -> list[Finding]:
    """Return what a guard's limits must be with a controller as it was measured.

    Args:
        escalate: time after which a guard goes on to the next stop path [s].
        stop_budget: returns the time that it gives a stop [s], of a speed [rad/s] and a deceleration [rad/s2].
        watchdog_hz: of the scene's arm.
    """
    start, shows, late = measured.start[1], measured.shows, measured.watchdog[1]
    found = [Finding("measured, controller", "ok", measured.what)]

    def judge(item: str, fits: bool, value: str, rule: str, remedy: str, wrong: Verdict = "warning") -> None:
        found.append(Finding(f"measured, {item}", "ok" if fits else wrong, value, rule, "" if fits else remedy))

    value = f"it shows after {1e3 * shows:.0f} ms (worst); a program starts after {1e3 * start:.0f} ms (p95)"
    needed, most = math.ceil(1e3 * _LIMIT_MARGIN * shows), 1e3 * MAX_ESCALATE
    remedy = f"escalate_ms = {needed} in [monitoring]; else each stop goes on to the next path"
    if needed > most:
        remedy = f"escalate_ms can be {most:g} at most: ask what holds controller or network up, and measure again"
    judge("a stop", shows <= escalate, value, f"{1e3 * escalate:g} ms", remedy, "bad")
    value = f"it ends a program {1e3 * late:.0f} ms after its period (worst)"
    rule = f"{1e3 * _WATCHDOG_LATENESS:g} ms, or {1e3 * _WATCHDOG_TIME:g} ms with the period"
    wanted = math.ceil(10.0 / max(0.01, _WATCHDOG_TIME - late)) / 10.0
    remedy = f"watchdog_hz = {wanted:g} in [arm]; else a program without its guard goes on for longer"
    if wanted > _MOST_HZ:
        wanted, remedy = math.inf, "no watchdog_hz mends this: ask what holds the controller up, and measure again"
    fits = late <= _WATCHDOG_LATENESS or watchdog_hz >= wanted
    judge("watchdog", fits, value, rule, remedy, "warning" if wanted <= _MOST_HZ else "bad")
    for path, motion, speed, stood in measured.stops:
        budget = stop_budget(speed, MEASURED_DECELERATION)
        if path != "slider" and stood > budget:
            value = f"{path} stops {motion} from {speed:.2f} rad/s in {1e3 * stood:.0f} ms (worst)"
            remedy = f"deceleration_rad_s2 = {0.8 * speed / max(stood - 4.0 * escalate, 1e-3):.1f}, or a lower speed"
            judge("stop", False, value, f"{1e3 * budget:.0f} ms", remedy)
    return found
