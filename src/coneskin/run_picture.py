"""A picture of a recorded run: joint speeds and the touch over time, and the arm with the point and its normal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .errors import MissingExtra
from .replay import Run
from .robot.journal import GuardEvent, Kind
from .robot.state_reader import ControllerState, decode_state
from .scene import Scene

__all__ = ["draw_run"]

_MARKS = {"standstill": "stands", "latched": "latched"}


def draw_run(run: Run, path: Path) -> None:
    """Draw a run into a file whose suffix says how (png, svg, pdf).

    Raises:
        MissingExtra: matplotlib is not installed.
    """
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
    latched = _first(run.events, "latched", zero)
    window = (zero - 0.3, (latched.time if latched else zero + 1.0) + 0.2)
    contact = _first(run.events, "contact_placed", zero) or contact
    figure = Figure(figsize=(12.0, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.5, 1.0))
    _draw_speeds(figure.add_subplot(grid[0, 0]), states, run.events, zero, window)
    _draw_touch(figure.add_subplot(grid[1, 0]), run, scene, zero, window)
    if scene.arm is not None and states:
        _draw_arm(figure.add_subplot(grid[:, 1], projection="3d"), scene, states, contact, zero)
    figure.savefig(path, dpi=130)


def _first(events: list[GuardEvent], name: str, since: float = 0.0) -> GuardEvent | None:
    return next((event for event in events if event.name == name and event.time >= since), None)


def _draw_speeds(
    axes: Any, states: list[ControllerState], events: list[GuardEvent], zero: float, window: tuple[float, float]
) -> None:
    shown = [state for state in states if window[0] <= state.time <= window[1]]
    times = [1e3 * (state.time - zero) for state in shown]
    for joint in range(6):
        axes.plot(times, [state.qd[joint] for state in shown], lw=1.3, label=f"joint {joint + 1}")
    axes.axvline(0.0, color="tab:red", lw=1.0)
    shown_marks = [("touch ", 0.0, "right", "tab:red")]
    for name, words in _MARKS.items():
        if (event := _first(events, name, zero)) is not None:
            shown_marks.append((f" {words}", 1e3 * (event.time - zero), "left", "0.3"))
            axes.axvline(1e3 * (event.time - zero), color="0.6", lw=0.7, ls=":")
    for words, at, side, colour in shown_marks:
        axes.text(at, 1.01, words, color=colour, transform=axes.get_xaxis_transform(), ha=side, fontsize=8)
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
    for placed in place_on_arm(scene):
        base_link = link_pose(arm, touched.q, placed.link)
        for u in (0.0, 0.5, 1.0):
            frustum = placed.frustum.frustum
            ring = [base_link.apply(placed.frustum.point(u * frustum.slant, frustum.wrap * k / 48)) for k in range(49)]
            axes.plot(*zip(*ring, strict=True), lw=0.8, color="tab:green")
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
