"""Examination of a controller, against the simulated one: what another client holds, and what is not there."""

import socket
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.core.finding import Finding
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import ExaminationScope
from coneskin.robot.sim.process import free_host
from coneskin.robot.ur import examination
from coneskin.robot.ur.examination import _braking, _state, examine
from coneskin.robot.ur.rtde_connection import RtdeConnection
from tests.support.served_controller import served

ALL = ExaminationScope(control=True, slider=True, setpoints=True, heartbeat=True)


def verdicts(findings: list[Finding]) -> dict[str, str]:
    return {one.item.removeprefix("arm, "): one.verdict for one in findings}


def test_where_no_controller_is_the_rest_is_not_tried() -> None:
    first, *rest = examine(arm_model("UR5e"), free_host(), ALL)
    assert (first.item, first.verdict) == ("arm, RTDE", "bad")
    assert "coneskin sim-ur" in first.remedy
    assert {one.verdict for one in rest} == {"not tried"}


@pytest.mark.pure  # its connection is patched
def test_an_old_controller_that_tells_no_payload_is_taken_to_carry_none(monkeypatch: pytest.MonkeyPatch) -> None:
    old = SimpleNamespace(ask_outputs=Mock(side_effect=RobotRefused("NOT_FOUND")))
    monkeypatch.setattr(examination, "RtdeConnection", lambda *_: nullcontext(old))
    (found,) = _braking(arm_model("UR5e"), "nowhere", 10.0)
    assert (found.verdict, found.value[:35]) == ("ok", "stretched out with 0 kg, its motors")


@pytest.mark.parametrize(
    ("steps", "verdict"),
    [
        ([0.0024] * 40, "ok"),  # a fifth more than the cycle
        ([0.002] * 39 + [0.02], "ok"),
        ([0.003] * 40, "warning"),
        ([0.002] * 39 + [0.03], "warning"),
    ],
)
def test_states_that_come_late_or_with_a_gap_are_a_warning(
    monkeypatch: pytest.MonkeyPatch, steps: list[float], verdict: str
) -> None:
    now, left = [100.0], iter(steps)

    def read() -> list[bytes]:
        step = next(left, None)
        now[0] += step or 9.0
        return [] if step is None else [b""]

    state = SimpleNamespace(powered=True, stopped_by_safety=False)
    reader = SimpleNamespace(wait=lambda _: state, read=read)
    for name, value in {
        "StateReader": lambda *_: nullcontext(reader),
        "wait_readable": lambda *_: None,
        "decode_state": lambda time, _: SimpleNamespace(time=time, **vars(state)),
        "time": SimpleNamespace(monotonic=lambda: now[0]),
    }.items():
        monkeypatch.setattr(examination, name, value)
    assert verdicts(list(_state("nowhere", 0.002))) == {"power": "ok", "safety": "ok", "latency": verdict}


@pytest.mark.long
def test_a_controller_is_examined_and_what_others_hold_is_named() -> None:
    with served() as simulated:
        found = examine(arm_model("UR5e"), simulated.host, ALL)
        assert {name for name, verdict in verdicts(found).items() if verdict not in ("ok", "warning")} == set()
        assert verdicts(found).keys() >= {"RTDE", "model", "power", "safety", "stops", "latency"}
        assert {one.item: one for one in found}["arm, braking"].value.startswith(
            "stretched out with 0 kg, its motors brake"
        )
        with socket.create_connection((simulated.host, 30002), timeout=60) as scripts:
            scripts.sendall(b"sec carries():\n  set_payload(5)\nend\n")
        while "with 5 kg" not in (braking := _braking(arm_model("UR5e"), simulated.host, 10.0)[0]).value:
            pass
        assert (braking.verdict, braking.remedy[:28]) == (
            "warning",
            "deceleration_rad_s2 = 6.6 in",
        )  # as bench deceleration
        held = ["input_int_register_0", "speed_slider_mask", "speed_slider_fraction"]
        with RtdeConnection(simulated.host) as other:
            other.ask_inputs(held)
            again = examine(arm_model("UR10e"), simulated.host, ALL._replace(setpoints=False))
        bad = {one.item: one for one in again if one.verdict == "bad"}
        assert set(bad) == {"arm, model", "arm, ur_rtde's registers", "arm, the speed slider"}
        assert "UR5e" in bad["arm, model"].value
        assert "disable EtherNet/IP" in bad["arm, ur_rtde's registers"].remedy
        assert verdicts(again)["the setpoints' registers"] == "not tried"
        simulated.call("local control")
        last = {one.item: one for one in examine(arm_model("UR5e"), simulated.host, ALL)}["arm, stops"]
        assert (last.verdict, "Choose Remote Control" in last.value) == ("bad", True)
