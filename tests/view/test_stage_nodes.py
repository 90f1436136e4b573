"""Nodes of a stage: the bodies are where the run says they were."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.geometry.pose import Vector
from coneskin.robot.guard.signals.journal import BlockKind, force_block
from coneskin.runs.replay.run import Run
from coneskin.view.live_page import LivePage, LiveRun
from coneskin.view.run_course import History, read_courses
from coneskin.view.stage_nodes import StageNodes
from tests.support.scenes import forearm_scene

BODIES = """
[[body]]
kind = "wall"
xyz_mm = [0, 500, 300]
direction = [0, -1, 0]
[[body]]
kind = "grip"
xyz_mm = [100, 200, 300]
direction = [0, 0.2, 0]
force_n = 30
mass_kg = 0.6
stiffness_n_per_mm = 2
"""
STARTS = ((0.0, 0.5, 0.3), (0.1, 0.2, 0.3), (0.1, 0.4, 0.3))
PUSHED = ((0.0, 0.5, 0.3), (0.13, 0.2, 0.3), (0.1, 0.35, 0.32))


class Node:
    def __init__(self, position: Vector, vertices: np.ndarray | None) -> None:
        self.position, self.vertices = position, vertices


class Scene:
    """What a page's scene is asked for, and where its nodes are then."""

    def __init__(self) -> None:
        self.nodes: dict[str, Node] = {}

    def add_frame(self, name: str, position: Vector = (0.0, 0.0, 0.0), **_: object) -> Node:
        return self.nodes.setdefault(name, Node(position, None))

    def add_mesh_simple(self, name: str, vertices: np.ndarray, _faces: np.ndarray, **_: object) -> Node:
        return self.nodes.setdefault(name, Node((0.0, 0.0, 0.0), vertices))

    def middles(self, root: str) -> list[Vector]:
        """Where the bodies are drawn [m]: the middles of the balls, and of the wall's face."""
        found = []
        for name, node in self.nodes.items():
            if name.startswith(f"{root}/body ") and node.vertices is not None:
                low, high = node.vertices.min(axis=0), node.vertices.max(axis=0)
                middle = 0.5 * (low + high) if "wall" not in name else np.array((0.0, low[1], 0.5 * (low[2] + high[2])))
                found.append(tuple(middle + self.nodes[name.rpartition("/")[0]].position))
        return found

    def __getattr__(self, _: str) -> Callable[..., None]:
        return lambda *_args, **_options: None  # lights, floor, and what else no body depends on


def blocks_of(*told: tuple[float, tuple[Vector, ...]]) -> list[Block]:
    text = forearm_scene() + BODIES
    header = {"scene": text, "name": "scene.toml", "folder": ".", "clocks": {"monotonic": 100.0}}
    truths = [force_block(time, 1.0, places) for time, places in told]
    return [Block(BlockKind.HEADER, 100.0, json.dumps(header).encode()), *truths, Block(BlockKind.TICK, 110.0, b"")]


def recorded(folder: Path, *told: tuple[float, tuple[Vector, ...]]) -> Path:
    with Recorder(folder / "run.rec") as recorder:
        recorder.write(*blocks_of(*told))
    return folder / "run.rec"


def near(places: Sequence[Vector]) -> list[Any]:
    return [pytest.approx(place, abs=1e-6) for place in places]


def test_bodies_are_where_the_run_says_and_where_the_scene_puts_them_before(tmp_path: Path) -> None:
    (course,) = read_courses([recorded(tmp_path, (101.0, PUSHED), (103.0, STARTS))])
    scene = Scene()
    nodes = StageNodes(scene, course.stage, "/run")
    for time, places in ((0.5, STARTS), (1.0, PUSHED), (2.9, PUSHED), (3.0, STARTS), (1.5, PUSHED)):
        nodes.show(course.moment(time))
        assert scene.middles("/run") == near(places), time


def test_places_of_other_bodies_than_the_scenes_move_nothing(tmp_path: Path) -> None:
    (course,) = read_courses([recorded(tmp_path, (101.0, PUSHED[:2]))])
    scene = Scene()
    StageNodes(scene, course.stage, "/run").show(course.moment(1.5))
    assert scene.middles("/run") == near(STARTS)


def test_a_live_page_moves_bodies_with_the_arm(tmp_path: Path) -> None:
    """Both are late by the wait for a parcel, so that none goes through the other."""
    server = SimpleNamespace(
        scene=Scene(), gui=MagicMock(), look_from=lambda *_: None, on_viewer=lambda _: None, together=nullcontext
    )
    live = LiveRun(recorded(tmp_path, (101.0, PUSHED), (109.96, STARTS)))
    page = LivePage(server, live.course.stage, lambda _: live)  # type: ignore[arg-type]
    assert server.scene.middles("/run") == near(STARTS)
    page.poll(0.0)
    page.draw(0.0)
    assert server.scene.middles("/run") == near(PUSHED)
    page.draw(0.04)
    assert server.scene.middles("/run") == near(STARTS)
    page.close()


@pytest.mark.parametrize(
    ("ended", "silence", "follows"), [(False, 0.9, False), (False, 1.1, True), (True, 0.0, True), (True, 31.0, True)]
)
def test_a_live_page_follows_the_next_run_once_its_own_has_ended_or_is_silent(
    ended: bool, silence: float, follows: bool, tmp_path: Path
) -> None:
    course = read_courses([recorded(tmp_path)])[0]
    server = SimpleNamespace(scene=Scene(), gui=MagicMock(), on_viewer=lambda _: None, look_from=lambda *_: None)
    own, following = (
        MagicMock(course=course, ended=over, silence=quiet) for over, quiet in ((ended, silence), (False, 0.0))
    )
    runs = [own, following]
    page = LivePage(server, course.stage, lambda _: runs.pop(0))  # type: ignore[arg-type]
    page.poll(0.0)
    assert page.poll(1.0) is follows
    assert own.close.called is follows
    assert not following.close.called


def test_a_page_that_forgets_still_knows_where_a_body_came_to_rest() -> None:
    blocks = blocks_of((101.0, PUSHED))
    history = History(Run(json.loads(blocks[0].payload), blocks).scene(), 60.0)
    history.feed_all([*blocks, Block(BlockKind.TICK, 300.0, b"")])
    assert history.since == 240.0
    assert history.places(250.0) == PUSHED
