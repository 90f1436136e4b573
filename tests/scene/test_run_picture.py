"""The picture of a run: drawn from a recording, and it shows what was recorded."""

from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import pytest

from coneskin.errors import MissingExtra
from coneskin.replay import Run, read_run
from coneskin.robot.journal import Kind
from coneskin.robot.kinematics import link_pose
from coneskin.robot.ur_models import model
from coneskin.run_picture import draw_run

from .scenes import SKIN_ONLY, Q, record

pytest.importorskip("matplotlib", reason="the extra coneskin[pictures] is not installed")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("run")
    record(folder / "run.rec")
    return read_run(folder)


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are saved."""
    from matplotlib.figure import Figure

    saved: list[Any] = []
    real = Figure.savefig

    def save(figure: Any, *args: Any, **kwargs: Any) -> None:
        saved.append(figure)
        real(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", save)
    return saved


def test_a_collision_with_an_arm(run: Run, tmp_path: Path, figures: list[Any]) -> None:
    draw_run(run, tmp_path / "run.png")
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    ((speeds, touch, arm),) = [figure.axes for figure in figures]
    joint_1 = speeds.lines[0]
    start, end = joint_1.get_ydata()[0], joint_1.get_ydata()[-1]
    assert (start, end) == (0.5, 0.0)  # as recorded: 0.5 rad/s before the touch, standing at the end
    moving = [t for t, speed in zip(joint_1.get_xdata(), joint_1.get_ydata(), strict=True) if speed > 0.25]
    assert 0.0 < max(moving) < 60.0  # ms after the touch: it brakes from 5 ms on, at 10 rad/s2
    levels = {line.get_label(): max(line.get_ydata()) for line in touch.lines if not line.get_label().startswith("_")}
    assert levels["towards the elbow"] < 0.05 < 0.1 < levels["towards the wrist"]
    assert {"at the touch", "at the end", "touch and normal"} <= set(arm.get_legend_handles_labels()[1])
    (point,) = [c for c in arm.collections if c.get_label() == "touch and normal"]
    drawn = tuple(float(value[0]) for value in point._offsets3d)
    placed = next(event for event in run.events if event.name == "contact_placed")
    base_link = link_pose(model("UR5e"), Q, 3)  # the forearm's DH frame is the third
    assert drawn == pytest.approx(base_link.apply(placed.details["point"]), abs=1e-12)


def test_a_skin_without_an_arm(tmp_path: Path, figures: list[Any]) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    draw_run(read_run(tmp_path), tmp_path / "run.svg")
    assert len(figures[0].axes) == 2


@pytest.mark.parametrize("kinds", [{Kind.ARM}, {Kind.SKIN}, {Kind.EVENT}, {Kind.EVENT, Kind.SKIN, Kind.ARM}])
def test_a_run_that_lacks_something(run: Run, tmp_path: Path, kinds: set[Kind]) -> None:
    blocks = tuple(block for block in run.blocks if block.kind not in kinds)
    draw_run(changed(run, blocks=blocks), tmp_path / "run.png")
    draw_run(changed(run, blocks=()), tmp_path / "empty.png")
    assert (tmp_path / "run.png").is_file()


def test_without_matplotlib(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    with pytest.raises(
        MissingExtra, match=r"a picture needs the package matplotlib: pip install 'coneskin\[pictures\]'"
    ):
        draw_run(run, tmp_path / "run.png")
