"""Picture of a recorded run: joint speeds, speed slider and touch over time, and the arm with the point touched."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.picture_file import LINE_DASHES, write_picture
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.signals.journal import GuardEvent, stopping_contact
from coneskin.scene.build import SensorOnArm
from coneskin.scene.values.scene import Scene

from .run import Run

_EVENT_MARKS = {"speed_reduced": "slows", "resumed": "goes on", "standstill": "stands", "latched": "latched"}
_MAX_GAP = 0.05  # s between two states, from which on nothing is drawn between them: nobody has measured it
_MIN_SPACING = 0.08  # of the width; marks that are closer share a label
_TOUCH_COLOR, _AWAY_COLOR = "#b5179e", "#E69F00"


def draw_run(run: Run, path: Path) -> None:
    """Draw a run into a file, in the format of its suffix (png, svg, pdf).

    Raises:
        MissingExtra: matplotlib is not installed.
        RecordingError: the file cannot be written, or its suffix is another.
    """
    write_picture(path, "the picture of a run", lambda figure: _compose(figure, run), RecordingError)


def _compose(figure: Any, run: Run) -> None:
    scene = run.scene()
    states, slider = list(run.states()), list(run.slider())
    if len({fraction for _, fraction in slider}) < 2:
        slider = []  # one that stands still says nothing
    contact = _first(run.events, "contact")
    stopping = _first(run.events, "stopping")
    origin = next((event for event in (contact, stopping) if event is not None), None)
    first = next(iter(run.blocks), None)
    zero = origin.time if origin else 0.0 if first is None else first.time
    word = "touch" if contact else "stop" if stopping else "start"  # of what happens at zero
    ends = [state.time for state in (*states[:1], *states[-1:])] or [zero - 0.3, zero + 1.0]
    window = max(zero - 0.3, min(ends[0], zero)), min(_last(run.events, zero) + 0.2, max(ends[-1], zero + 0.1))
    stop = next((event for event in run.events if event.name == "stopping" and "contact" in event.details), None)
    contact = (stopping_contact(stop, run.events) if stop else _first(run.events, "contact_located", zero)) or contact
    figure.set_size_inches(12.0, 7.6 if slider else 6.4)
    heights = (1.0, 0.4, 1.0) if slider else (1.0, 1.0)
    grid = figure.add_gridspec(len(heights), 2, width_ratios=(1.5, 1.0), height_ratios=heights)
    _draw_speeds(figure.add_subplot(grid[0, 0]), states, run.events, zero, window, word)
    if slider:
        _draw_slider(figure.add_subplot(grid[1, 0]), slider, zero)
    _draw_touch(figure.add_subplot(grid[-1, 0]), run, scene, zero, window)
    for axes in figure.axes:
        axes.set_xlim(*(1e3 * (t - zero) for t in window))
        axes.grid()
    away, back = (_first(run.events, name, zero) for name in ("retreating", "retreated"))
    if away is not None and away.time < window[1]:
        until = window[1] if back is None else back.time
        for axes in figure.axes:
            axes.axvspan(1e3 * (away.time - zero), 1e3 * (until - zero), color=_AWAY_COLOR, alpha=0.15, lw=0)
    figure.axes[-1].set_xlabel(f"time since the {'touch was seen' if contact else word} [ms]; shaded: moves away")
    if scene.arm is not None and states:
        axes = figure.add_subplot(grid[:, 1], projection="3d")
        _draw_arm(axes, scene, run.place_sensors(), states, contact, zero, word)


def _vector(event: GuardEvent, key: str) -> tuple[float, float, float]:
    found = event.details.get(key)
    if not isinstance(found, list) or len(found) != 3 or not all(isinstance(x, float) and abs(x) < 1e3 for x in found):
        raise RecordingError(f"the event {event.name} of {event.time:.6f} s has no {key} of 3 numbers")
    x, y, z = found
    return x, y, z


def _first(events: list[GuardEvent], name: str, since: float = 0.0) -> GuardEvent | None:
    return next((event for event in events if event.name == name and event.time >= since), None)


def _last(events: list[GuardEvent], zero: float) -> float:
    """Return when the reaction is over [s]: the arm is latched, or goes on; a guard that ends does not count."""
    latched, ending = _first(events, "latched", zero), _first(events, "ending", zero)
    if latched is not None and ending is not None and latched.time >= ending.time:
        latched = None
    over = latched or _first(events, "resumed", zero)
    return zero + 1.0 if over is None else over.time


def _marks(events: list[GuardEvent], zero: float, window: tuple[float, float]) -> list[tuple[float, str]]:
    """Return the moments after the touch [s] in the window and their labels; moments close together share one."""
    found = [
        (event.time, words) for name, words in _EVENT_MARKS.items() if (event := _first(events, name, zero)) is not None
    ]
    marks: list[tuple[float, str]] = []
    for time, words in sorted((item for item in found if item[0] <= window[1]), key=lambda item: item[0]):
        if marks and time - marks[-1][0] < _MIN_SPACING * (window[1] - window[0]):
            marks[-1] = (marks[-1][0], f"{marks[-1][1]}, {words}")
        else:
            marks.append((time, words))
    return marks


def _draw_slider(axes: Any, slider: list[tuple[float, float]], zero: float) -> None:
    axes.plot(
        [1e3 * (t - zero) for t, _ in slider], [100.0 * f for _, f in slider], drawstyle="steps-post", color="0.2"
    )
    axes.axvline(0.0, color=_TOUCH_COLOR, lw=1.0)
    axes.set_ylabel("speed slider [%]")
    axes.set_ylim(0.0, 105.0)


def _draw_speeds(
    axes: Any,
    states: list[ControllerState],
    events: list[GuardEvent],
    zero: float,
    window: tuple[float, float],
    word: str,
) -> None:
    shown = [state for state in states if window[0] <= state.time <= window[1]]
    times: list[float] = []
    measured: list[Sequence[float]] = []
    for before, state in zip([None, *shown], shown, strict=False):
        if before is not None and state.time - before.time > _MAX_GAP:
            gap = 1e3 * (before.time - zero), 1e3 * (state.time - zero)
            axes.axvspan(*gap, color="0.9", label="_")
            axes.text(sum(gap) / 2.0, 0.02, "no states", ha="center", fontsize=7, transform=axes.get_xaxis_transform())
            times.append(gap[0])
            measured.append([math.nan] * len(state.qd))
        times.append(1e3 * (state.time - zero))
        measured.append(state.qd)
    for joint, speeds in enumerate(zip(*measured, strict=True)):
        axes.plot(times, speeds, LINE_DASHES[joint % len(LINE_DASHES)], lw=1.3, label=f"joint {joint + 1}")
    axes.axvline(0.0, color=_TOUCH_COLOR, lw=1.0)
    style = {"transform": axes.get_xaxis_transform(), "fontsize": 8}
    axes.text(0.0, 1.01, f"{word} ", color=_TOUCH_COLOR, ha="right", **style)
    for time, words in _marks(events, zero, window):
        axes.axvline(1e3 * (time - zero), color="0.6", lw=0.7, ls=":")
        axes.text(1e3 * (time - zero), 1.01, f" {words}", color="0.3", ha="left", **style)
    axes.set_ylabel("joint speed [rad/s]")
    if measured:
        axes.legend(ncols=3, loc="best")


def _draw_touch(axes: Any, run: Run, scene: Scene, zero: float, window: tuple[float, float]) -> None:
    from coneskin.skin.detection.frame.reading import read

    sensors = {(item.sensor.device_id, item.sensor.sensor_id): item.sensor for item in scene.sensors}
    series: dict[str, tuple[list[float], list[float]]] = {item.sensor.name: ([], []) for item in scene.sensors}
    for time, frame in run.frames():
        sensor = sensors.get((frame.device, frame.sensor))
        if sensor is not None and window[0] <= time <= window[1]:
            times, levels = series[sensor.name]
            times.append(1e3 * (time - zero))
            levels.append(read(sensor, frame).level)
    for number, item in enumerate(scene.sensors):
        dash = LINE_DASHES[number % len(LINE_DASHES)]
        axes.plot(*series[item.sensor.name], dash, lw=1.2, label=item.sensor.name)
        axes.axhline(item.sensor.thresholds.touch_level, color=_TOUCH_COLOR, lw=0.8, ls="--")
        axes.axhline(item.sensor.thresholds.release_level, color="0.5", lw=0.8, ls=":")
    axes.set_ylabel("touch level (dashed: on, dotted: off)")
    axes.set_ylim(0.0, 1.0)
    axes.legend(fontsize=7)


def _draw_arm(
    axes: Any,
    scene: Scene,
    sensors: list[SensorOnArm],
    states: list[ControllerState],
    contact: GuardEvent | None,
    zero: float,
    word: str,
) -> None:
    from coneskin.robot.arm.kinematics import link_pose
    from coneskin.robot.arm.workspace import skeleton

    assert scene.arm is not None
    arm = scene.arm.arm_model
    touched = min(states, key=lambda state: abs(state.time - zero))
    for state, colour, label in ((states[-1], "0.7", "at the end"), (touched, "#0072B2", f"at the {word}")):
        axes.plot(*zip(*skeleton(arm, state.q), strict=True), "-o", ms=3, lw=3, color=colour, label=label)
    label = "sensor: ends and middle"
    for placed in sensors:
        base_link = link_pose(arm, touched.q, placed.link)
        for u in (0.0, 0.5, 1.0):
            frustum = placed.frustum.frustum
            ring = [base_link.apply(placed.frustum.point(u * frustum.slant, frustum.wrap * k / 48)) for k in range(49)]
            axes.plot(*zip(*ring, strict=True), lw=0.8, color="#009E73", label=label)
            label = "_"  # once is enough
        if contact is not None and contact.details.get("sensor") == placed.name:
            point = base_link.apply(_vector(contact, "point"))
            normal = base_link.rotate(_vector(contact, "normal"))
            axes.scatter(*([value] for value in point), color=_TOUCH_COLOR, s=30, label="touch and normal")
            axes.quiver(*point, *normal, length=0.2, color=_TOUCH_COLOR, lw=1.5)
    axes.set_box_aspect((1, 1, 1), zoom=0.88)  # room for the label of z, which the layout does not know
    spans = [(min(c), max(c)) for c in zip(*skeleton(arm, touched.q), strict=True)]
    reach = 0.1 + 0.5 * max(high - low for low, high in spans)
    for (low, high), setter in zip(spans, (axes.set_xlim, axes.set_ylim, axes.set_zlim), strict=True):
        setter(0.5 * (low + high) - reach, 0.5 * (low + high) + reach)
    axes.set_xlabel("x [m]", labelpad=9.0)
    axes.set_ylabel("y [m]", labelpad=9.0)
    axes.set_zlabel("z [m]", labelpad=6.0)
    axes.legend(fontsize=7, loc="upper left")
    axes.set_title(f"{arm.name}, base frame", fontsize=9)
