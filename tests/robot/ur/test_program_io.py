"""Variables and outputs for the guarded program, against the simulated controller in a process of its own."""

import struct
import time

import pytest

from coneskin.core.errors import RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.ur.program_io import RtdeOutputWriter, RtdeVariableReader
from coneskin.robot.ur.rtde_codec import Recipe
from tests.support.scenes import START


@pytest.fixture(scope="module")
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


def until(what):
    end = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)


def until_refused(read):
    """Read until the connection is known to be gone."""

    def is_refused():
        try:
            read()
        except RobotConnectionError as exc:
            return "the state of the arm cannot be read" in str(exc)
        return False

    until(is_refused)


@pytest.mark.parametrize(
    ("output", "packed"),
    [
        ((0, 0.25), (1, 1, 0.25, 0.0)),
        ((1, 0.25), (2, 2, 0.0, 0.25)),
        ((0, 0.25, "current"), (1, 0, 0.25, 0.0)),
        ((1, 1.0, "current"), (2, 0, 0.0, 1.0)),
    ],
)
def test_an_analog_output_has_its_bit_in_the_mask_and_a_voltage_in_the_types(
    monkeypatch: pytest.MonkeyPatch, output, packed
) -> None:
    """RTDE guide: two bytes whose bits 0 and 1 are the outputs, 1 for a voltage, and the ratios of both."""
    writer, sent = RtdeOutputWriter("nowhere"), []
    monkeypatch.setattr(writer, "_write", lambda names, values: sent.append(Recipe(names).pack(values)))
    writer.set_analog(*output)
    assert sent == [b"\x01" + struct.pack(">BBdd", *packed)]


@pytest.mark.long
def test_a_value_is_never_old_and_a_connection_that_is_gone_is_opened_again(controller) -> None:
    with RtdeVariableReader(controller.host, timeout=60.0) as reader:
        assert reader.value("actual_q") == pytest.approx(START)
        assert reader.value("joint_temperatures") == (30.0,) * 6  # not among the usual ones
        before = reader.value("timestamp")
        reader._timeout = 0.3
        controller.freeze()
        try:
            with pytest.raises(RobotTimeout, match=r"has sent no state for 0\.3 s"):
                until(lambda: reader.reading() is None)  # the last state is fresh for 0.1 s
        finally:
            controller.thaw()
        reader._timeout = 60.0
        assert reader.value("timestamp") >= before
        controller.call("close rtde")
        until_refused(lambda: reader.value("timestamp"))
        assert reader.reading().q == pytest.approx(START)
        with pytest.raises(RobotRefused, match="RTDE has no variable named actual_qqq"):
            reader.value("actual_qqq")
