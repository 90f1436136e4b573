"""The picture of a run: drawn from a recording, and it shows what was recorded."""

from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.errors import MissingExtra, RecordingError
from coneskin.core.recording.block import Block
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.ur.rtde_codec import Recipe
from coneskin.runs.replay.run import Run, read_run
from coneskin.runs.replay.run_picture import draw_run
from tests.scene.scenes import SKIN_ONLY, Q, record
from tests.support.sweep import sweep

pytest.importorskip("matplotlib", reason="the extra coneskin[pictures] is not installed")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("run")
    record(folder / "run.rec")
    return read_run(folder)


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Collect the figures that are saved."""
    from matplotlib.figure import Figure

    saved: list[Any] = []
    real = Figure.savefig

    def save(figure: Any, *args: Any, **kwargs: Any) -> None:
        saved.append(figure)
        real(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", save)
    return saved


@pytest.mark.long
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
    placed = next(event for event in run.events if event.name == "contact_located")
    base_link = link_pose(arm_model("UR5e"), Q, 3)  # the forearm's DH frame is the third
    assert drawn == pytest.approx(base_link.apply(placed.details["point"]), abs=1e-12)


@pytest.mark.long
def test_colours_and_the_legend_tell_all_apart(run: Run, tmp_path: Path, figures: list[Any]) -> None:
    draw_run(run, tmp_path / "run.png")
    speeds, _, arm = figures[0].axes
    joints = [line.get_color() for line in speeds.lines if line.get_label().startswith("joint")]
    assert len(joints) == len(set(joints)) == 6
    assert "#b5179e" not in joints  # the touch
    rings = [line for line in arm.lines if line.get_color() == "#009E73"]
    assert len(rings) == 6  # three for each of two sensors
    assert arm.get_legend_handles_labels()[1].count("sensor: ends and middle") == 1


def slow(run: Run, latched: float = 1002.9) -> Run:
    """Return the run with the events of an arm that was slowed, went on, and stood when the guard ended."""
    contact = next(event.time for event in run.events if event.name == "contact")
    happened = [
        GuardEvent("speed_reduced", contact, {"slider": 0.2, "before": 1.0}),
        *(event for event in run.events if event.name in ("contact", "contact_located")),
        GuardEvent("resumed", contact + 0.8, {"slider": 1.0}),
        GuardEvent("ending", latched, {"what": "the guard was told to end"}),
        GuardEvent("standstill", latched, {"speed": 0.0, "paths": ["driver"]}),
        GuardEvent("latched", latched, {"why": "the guard was told to end"}),
    ]
    inputs = [block for block in run.blocks if block.kind != BlockKind.EVENT]
    fractions = [(contact + 0.02 * k, 0.2 if 0 <= k < 40 else 1.0) for k in range(-10, 60)]
    read = [Block(BlockKind.SLIDER, t, Recipe(("target_speed_fraction",)).pack((f,))) for t, f in fractions]
    blocks = sorted([*inputs, *read, *(event.block() for event in happened)], key=lambda block: block.time)
    return changed(run, blocks=tuple(blocks))


@pytest.mark.long
def test_a_slow_run_shows_its_slider_and_ends_where_the_arm_goes_on(
    run: Run, tmp_path: Path, figures: list[Any]
) -> None:
    draw_run(slow(run), tmp_path / "run.png")
    speeds, slider, _, _ = figures[0].axes
    assert slider.get_ylabel() == "speed slider [%]"
    times, fractions = slider.lines[0].get_data()
    low = [t for t, f in zip(times, fractions, strict=True) if f == pytest.approx(20.0)]
    assert (min(low), max(low)) == pytest.approx((0.0, 780.0))  # ms since the touch
    assert [text.get_text() for text in speeds.texts] == ["touch ", " slows", " goes on"]
    assert speeds.get_xlim() == pytest.approx((-300.0, 894.0))  # the data end there


@pytest.mark.long
def test_marks_that_would_hide_each_other_share_a_label(run: Run, tmp_path: Path, figures: list[Any]) -> None:
    """After a stop, the arm is latched where it stands."""
    contact = next(event for event in run.events if event.name == "contact")
    happened = [
        contact,
        GuardEvent("standstill", contact.time + 0.1, {"speed": 0.0, "paths": ["driver"]}),
        GuardEvent("latched", contact.time + 0.1, {"why": "touch"}),
    ]
    blocks = [block for block in run.blocks if block.kind != BlockKind.EVENT]
    draw_run(changed(run, blocks=(*blocks, *(event.block() for event in happened))), tmp_path / "run.png")
    assert [text.get_text() for text in figures[0].axes[0].texts] == ["touch ", " stands, latched"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("run.gif", r"is a \.png, \.svg, \.pdf file, got .*run\.gif"),
        ("run", r"is a \.png, \.svg, \.pdf file"),
        ("no/run.png", r"cannot be written to .*: there is no folder .*no; make it first"),
        ("folder.png", r"cannot be written to .*: Is a directory; name another file"),
    ],
)
@pytest.mark.long
def test_a_file_that_cannot_be_is_refused(run: Run, tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(RecordingError, match=words):
        draw_run(run, tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


@pytest.mark.long
def test_a_skin_without_an_arm(tmp_path: Path, figures: list[Any]) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    draw_run(read_run(tmp_path), tmp_path / "run.svg")
    assert len(figures[0].axes) == 2


@pytest.mark.long
@pytest.mark.parametrize(
    "kinds",
    sweep([{BlockKind.ARM}, {BlockKind.SKIN}, {BlockKind.EVENT}, {BlockKind.EVENT, BlockKind.SKIN, BlockKind.ARM}]),
)
def test_a_run_that_lacks_something(run: Run, tmp_path: Path, kinds: set[BlockKind]) -> None:
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
