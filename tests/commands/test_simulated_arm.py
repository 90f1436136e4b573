"""Simulated arm of a scene: it stands on this computer only, whatever the scene calls it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from coneskin.commands.simulated_arm import simulated_arm
from coneskin.core.errors import RobotRefused
from coneskin.robot.sim import process
from coneskin.scene.reader import parse_scene
from tests.support.scenes import forearm_scene


@pytest.mark.parametrize(
    ("host", "address"), [("localhost", "127.0.0.1"), ("127.0.0.7", "127.0.0.7"), ("192.168.0.7", None)]
)
def test_the_controller_listens_at_an_address_of_this_computer(
    host: str, address: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = []

    @contextmanager
    def controller(model: str, host: str, _: object, *, plant: object) -> Iterator[None]:
        started.append((model, host, plant))
        yield

    monkeypatch.setattr(process, "SimulatedController", controller)
    scene = parse_scene(forearm_scene().replace("127.0.0.1", host))
    if address is None:
        with pytest.raises(RobotRefused, match=f"arm.host is {host}"), simulated_arm(scene):
            pass
        assert not started
    else:
        with simulated_arm(scene) as line:
            assert line is None  # nothing presses the skin
        assert started == [("UR5e", address, None)]
