"""Values of an arm's driver: which bit of a word is which input or output."""

import pytest

from coneskin.robot.driver.values import ArmReading

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
