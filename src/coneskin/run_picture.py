"""A picture of a recorded run: joint speeds, speed slider and touch over time, and the arm with the point touched."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .errors import MissingExtra, RecordingError
from .replay import Run
from .robot.journal import GuardEvent, Kind
from .robot.speed_slider import decode_fraction
from .robot.state_reader import ControllerState, decode_state
from .scene import Scene

__all__ = ["draw_run"]

_SUFFIXES = (".png", ".svg", ".pdf")
_MARKS = {"slowing": "slows", "resumed": "goes on", "standstill": "stands", "latched": "latched"}
_NEAR = 0.08  # of the width; marks that are closer share a label
_JOINTS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:cyan")  # red is the touch


def draw_run(run: Run, path: Path) -> None:
    """Draw a run into a file whose suffix says how (png, svg, pdf).

    Raises:
        MissingExtra: matplotlib is not installed.
        RecordingError: the file cannot be written, or its suffix is another.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise RecordingError(f"the picture of a run is a {', '.join(_SUFFIXES)} file, got {path}")
    if not path.parent.is_dir():
        raise RecordingError(f"the picture {path} cannot be written: there is no folder {path.parent}; make it first")
    try:
        import matplotlib
    except ImportError as exc:
        raise MissingExtra("matplotlib", "a picture", "pictures") from exc
    matplotlib.use("Agg", force=False)
    from matplotlib.figure import Figure

    scene = run.scene()
    states = [decode_state(block.time, block.payload) for block in run.blocks if block.kind == Kind.ARM]
    contact = _first(run.events, "contact")
    zero = contact.time if contact else (run.blocks[0].time if run.blocks else 0.0)
    window = (zero - 0.3, _last(run.events, zero) + 0.2)
    contact = _first(run.events, "contact_placed", zero) or contact
    slider = [(block.time, decode_fraction(block.payload)) for block in run.blocks if block.kind == Kind.SLIDER]
    figure = Figure(figsize=(12.0, 7.6 if slider else 6.4), layout="constrained")
    heights = (1.0, 0.4, 1.0) if slider else (1.0, 1.0)
    grid = figure.add_gridspec(len(heights), 2, width_ratios=(1.5, 1.0), height_ratios=heights)
    _draw_speeds(figure.add_subplot(grid[0, 0]), states, run.events, zero, window)
    if slider:
        _draw_slider(figure.add_subplot(grid[1, 0]), slider, zero, window)
    _draw_touch(figure.add_subplot(grid[-1, 0]), run, scene, zero, window)
    if scene.arm is not None and states:
        _draw_arm(figure.add_subplot(grid[:, 1], projection="3d"), scene, states, contact, zero)
    try:
        figure.savefig(path, dpi=130)
    except OSError as exc:
        raise RecordingError(f"the picture {path} cannot be written: {exc.strerror or exc}; name another file") from exc


def _first(events: list[GuardEvent], name: str, since: float = 0.0) -> GuardEvent | None:
    return next((event for event in events if event.name == name and event.time >= since), None)


def _last(events: list[GuardEvent], zero: float) -> float:
    """When what the touch has set off is over [s]: the arm is latched, or goes on; a guard that ends does not count."""
    latched, ending = _first(events, "latched", zero), _first(events, "ending", zero)
    if latched is not None and ending is not None and latched.time >= ending.time:
        latched = None
    over = latched or _first(events, "resumed", zero)
    return zero + 1.0 if over is None else over.time


def _marks(events: list[GuardEvent], zero: float, window: tuple[float, float]) -> list[tuple[float, str]]:
    """Moments after the touch [s] in the window and their labels; one label for those that would hide each other."""
    found = [(event.time, words) for name, words in _MARKS.items() if (event := _first(events, name, zero)) is not None]
    marks: list[tuple[float, str]] = []
    for time, words in sorted((item for item in found if item[0] <= window[1]), key=lambda item: item[0]):
        if marks and time - marks[-1][0] < _NEAR * (window[1] - window[0]):
            marks[-1] = (marks[-1][0], f"{marks[-1][1]}, {words}")
        else:
            marks.append((time, words))
    return marks


def _draw_slider(axes: Any, slider: list[tuple[float, float]], zero: float, window: tuple[float, float]) -> None:
    axes.plot(
        [1e3 * (t - zero) for t, _ in slider], [100.0 * f for _, f in slider], drawstyle="steps-post", color="0.2"
    )
    axes.axvline(0.0, color="tab:red", lw=1.0)
    axes.set_ylabel("speed slider [%]")
    axes.set_ylim(0.0, 105.0)
    axes.set_xlim(*(1e3 * (t - zero) for t in window))
    axes.grid(alpha=0.3)


def _draw_speeds(
    axes: Any, states: list[ControllerState], events: list[GuardEvent], zero: float, window: tuple[float, float]
) -> None:
    shown = [state for state in states if window[0] <= state.time <= window[1]]
    times = [1e3 * (state.time - zero) for state in shown]
    for joint in range(6):
        speeds = [state.qd[joint] for state in shown]
        axes.plot(times, speeds, lw=1.3, color=_JOINTS[joint], label=f"joint {joint + 1}")
    axes.axvline(0.0, color="tab:red", lw=1.0)
    style = {"transform": axes.get_xaxis_transform(), "fontsize": 8}
    axes.text(0.0, 1.01, "touch ", color="tab:red", ha="right", **style)
    for time, words in _marks(events, zero, window):
        axes.axvline(1e3 * (time - zero), color="0.6", lw=0.7, ls=":")
        axes.text(1e3 * (time - zero), 1.01, f" {words}", color="0.3", ha="left", **style)
    axes.set_ylabel("joint speed [rad/s]")
    axes.set_xlim(*(1e3 * (t - zero) for t in window))
    axes.legend(fontsize=7, ncols=2, loc="best")
    axes.grid(alpha=0.3)


def _draw_touch(axes: Any, run: Run, scene: Scene, zero: float, window: tuple[float, float]) -> None:
    from .skin.reading import read
    from .skin.wire import Decoder

    sensors = {(item.sensor.device_id, item.sensor.sensor_id): item.sensor for item in scene.sensors}
    series: dict[str, tuple[list[float], list[float]]] = {item.sensor.name: ([], []) for item in scene.sensors}
    decoder = Decoder()
    for block in run.blocks:
        if block.kind != Kind.SKIN:
            continue
        for frame in decoder.feed(block.payload):
            sensor = sensors.get((frame.device, frame.sensor))
            if sensor is not None and window[0] <= block.time <= window[1]:
                times, levels = series[sensor.name]
                times.append(1e3 * (block.time - zero))
                levels.append(read(sensor, frame).level)
    for item in scene.sensors:
        axes.plot(*series[item.sensor.name], lw=1.2, label=item.sensor.name)
        axes.axhline(item.sensor.thresholds.touch_level, color="tab:red", lw=0.8, ls="--")
        axes.axhline(item.sensor.thresholds.release_level, color="0.5", lw=0.8, ls="--")
    axes.set_xlabel("time since the touch was seen [ms]")
    axes.set_ylabel("touch level (dashed: on, off)")
    axes.set_xlim(*(1e3 * (t - zero) for t in window))
    axes.set_ylim(-0.02, 1.0)
    axes.legend(fontsize=7)
    axes.grid(alpha=0.3)


def _draw_arm(axes: Any, scene: Scene, states: list[ControllerState], contact: GuardEvent | None, zero: float) -> None:
    from .build import place_on_arm
    from .robot.kinematics import link_pose
    from .robot.skeleton import skeleton
    from .robot.ur_models import model

    assert scene.arm is not None
    arm = model(scene.arm.model)
    touched = min(states, key=lambda state: abs(state.time - zero))
    for state, colour, label in ((states[-1], "0.7", "at the end"), (touched, "tab:blue", "at the touch")):
        axes.plot(*zip(*skeleton(arm, state.q), strict=True), "-o", ms=3, lw=3, color=colour, label=label)
    label = "sensor: ends and middle"
    for placed in place_on_arm(scene):
        base_link = link_pose(arm, touched.q, placed.link)
        for u in (0.0, 0.5, 1.0):
            frustum = placed.frustum.frustum
            ring = [base_link.apply(placed.frustum.point(u * frustum.slant, frustum.wrap * k / 48)) for k in range(49)]
            axes.plot(*zip(*ring, strict=True), lw=0.8, color="tab:green", label=label)
            label = "_"  # once is enough
        if contact is not None and contact.details["sensor"] == placed.name:
            point = base_link.apply(contact.details["point"])
            normal = base_link.rotate(contact.details["normal"])
            axes.scatter(*([value] for value in point), color="tab:red", s=30, label="touch and normal")
            axes.quiver(*point, *normal, length=0.2, color="tab:red", lw=1.5)
    axes.set_box_aspect((1, 1, 1), zoom=0.88)  # room for the label of z, which the layout does not know
    reach = 0.6 * (abs(arm.a[1]) + abs(arm.a[2]))
    middle = [0.5 * (min(c) + max(c)) for c in zip(*skeleton(arm, touched.q), strict=True)]
    for centre, setter in zip(middle, (axes.set_xlim, axes.set_ylim, axes.set_zlim), strict=True):
        setter(centre - reach, centre + reach)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_zlabel("z [m]")
    axes.legend(fontsize=7, loc="upper left")
    axes.set_title(f"{arm.name}, base frame", fontsize=9)
