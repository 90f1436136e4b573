"""Values of an arm's driver: which bit of a word is which input or output."""

import inspect

import pytest

from coneskin.robot.driver.values import ArmReading, Waypoint
from coneskin.session.arm_client import ArmClient

_BITS = [("standard", range(8)), ("configurable", range(8, 16)), ("tool", range(16, 18))]


def test_each_digital_input_and_output_has_its_bit_and_there_are_no_others() -> None:
    reading = ArmReading(0.0, *((0.0,) * 6,) * 5, "RUNNING", "NORMAL", 1.0, False, 0, 0, (0.0,) * 4, (0.0,) * 2)
    for group, bits in _BITS:
        for number, bit in enumerate(bits):
            one = reading._replace(digital_inputs=1 << bit, digital_outputs=~(1 << bit))
            assert (one.digital_input(number, group), one.digital_output(number, group)) == (True, False)
        for number in (-1, len(bits)):
            with pytest.raises(ValueError, match=f"no {group} input or output has the number {number}"):
                reading.digital_input(number, group)


@pytest.mark.parametrize(("owner", "count"), [(Waypoint, 4), (ArmClient, 4)])
def test_moves_are_as_fast_as_in_urscript_where_nothing_else_is_said(owner, count) -> None:
    """movej: 1.05 rad/s and 1.4 rad/s2; movel: 0.25 m/s and 1.2 m/s2. A move stops at its end, and is waited for."""
    names = [name for name in dir(owner) if name.startswith("move_") and name != "move_path"]
    assert len(names) == count
    for name in names:
        told = {key: one.default for key, one in inspect.signature(getattr(owner, name)).parameters.items()}
        wanted = (1.05, 1.4) if name.startswith("move_j") else (0.25, 1.2)
        assert (told["speed"], told["acceleration"]) == wanted, name
        assert told.get("blend", 0.0) == 0.0
        assert told.get("wait", True) is True


@pytest.mark.parametrize(("kind", "target"), [("x", [0.0] * 6), ("j", [0.0] * 7), ("l", [0.0] * 5)])
def test_a_message_of_another_kind_or_with_another_target_is_no_way_point(kind, target) -> None:
    assert Waypoint.from_message(["j", True, [1] * 6, 2, 3, 0]) == Waypoint("j", True, (1.0,) * 6, 2.0, 3.0, 0.0)
    with pytest.raises(ValueError, match="a way point has a kind j, l or p and a target of 6 numbers"):
        Waypoint.from_message([kind, True, target, 1.0, 1.0, 0.0])
