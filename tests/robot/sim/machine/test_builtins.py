"""Each URScript function of the simulated controller does what its example says, and the page lists them all."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.ports.rtde import RtdeOutputs
from coneskin.robot.sim.urscript.translator import translate
from tests.robot.sim.function_examples import EXAMPLES, NO_EFFECT
from tests.support.paths import ROOT
from tests.support.pinocchio_arm import pin_mass_matrix, pin_torques

PAGE = ROOT / "docs" / "look-up" / "sim-ur.md"
HOME = (0.1, -1.4, 1.5, -1.7, -1.4, 0.2)
_ALL = {name: example for examples in EXAMPLES.values() for name, example in examples.items()}


@pytest.mark.parametrize("name", _ALL)
def test_the_example_of_each_function_holds(name: str) -> None:
    *before, last = _ALL[name].splitlines()
    body = [*before, f"if {last}:", "write_output_integer_register(0, 1)", "end"]
    controller = Controller(Options(start_delay=0.0, start_q=HOME))
    RtdeOutputs(controller)  # whose values a program reads
    controller.load(translate("def p():\n" + "\n".join(body) + "\nend\n", Builtins.functions()))
    controller.update()
    for _ in range(3000):
        controller.update()
        if controller.program is None:
            break
    assert f"{name}(" in _ALL[name]
    assert controller.output_ints[0] == 1


@pytest.mark.parametrize("rotors", [False, True])
def test_the_dynamics_of_the_bare_arm_are_those_of_pinocchio(rotors: bool) -> None:
    pytest.importorskip("pinocchio")
    q, qd = [0.3, -1.1, 1.4, -0.6, -1.2, 0.5], [1.0, -0.8, 1.5, 2.0, -1.0, 0.7]
    text = f"""def p():
  m = get_mass_matrix({q}, {rotors})
  n = 0
  while n < 36:
    write_output_float_register(n, m[floor(n / 6), n % 6])
    n = n + 1
  end
  c = get_coriolis_and_centrifugal_torques({q}, {qd})
  while n < 42:
    write_output_float_register(n, c[n - 36])
    n = n + 1
  end
end
"""
    controller = Controller(Options(model="UR10e", start_delay=0.0, start_q=HOME))
    controller.load(translate(text, Builtins.functions()))
    for _ in range(20):
        controller.update()
    arm, inertia = arm_model("UR10e"), arm_inertia("UR10e")
    if not rotors:
        inertia = replace(inertia, rotor=ZERO_VELOCITY)
    wanted = [*np.ravel(pin_mass_matrix(arm, inertia, q)), *pin_torques(arm, inertia, 0.0, q, qd, [0.0] * 6)]
    assert controller.output_doubles[:42] == pytest.approx(wanted, abs=1e-12 * max(wanted))


def test_every_function_has_an_example() -> None:
    assert set(_ALL) == set(Builtins.functions())
    assert set(_ALL) >= NO_EFFECT


@pytest.mark.parametrize(
    ("example", "words"),
    [
        ('str_at("Hello", 10)', "from 0 to 4"),
        ('str_at("", 0)', "from 0 to -1"),
        ('str_sub("abcde", -5, 50)', "from 0 to 5"),
        ('to_num("one")', "is not a number"),
        ('str_cat("' + "x" * 1000 + '", "' + "y" * 30 + '")', "at most 1023 characters"),
        ('get_rtde_value("actual_q")', "this controller has no RTDE"),
        ("set_tool_voltage(13)", "0, 12 or 24 V"),
        ("set_standard_analog_out(0, 1.5)", "from 0 to 1"),
        ("optimovej([0, 0, 0, 0, 0, 0], a=2)", "shares"),
        ("set_tool_communication(False, 1200, 0, 1, 1.5, 3.5)", "baud_rate is one of 9600, 19200"),
        ("set_tool_communication(False, 9600, 0, 1, 0.5, 3.5)", "rx_idle_chars is from 1 to 40"),
        ("set_tool_digital_output_mode(0, 4)", "one of 1, 2, 3"),
        ('set_standard_digital_input_action(8, "default")', "from 0 to 7"),
        ('set_standard_digital_input_action(0, "backdrive")', "action is one of 'default', 'freedrive'"),
        ("set_pos([0, 0, 4, 0, 0, 0])", "beyond the joints' limits"),
        ("speedj([0.1, 0, 0, 0, 0, 0], 40)\nset_pos([0, 0, 0, 0, 0, 0])", "this one moves"),
        ("movec(p[0,0,0,0,0,0], p[0,0,0,0,0,0], mode=3)", "mode of movec"),
    ],
)
def test_what_no_controller_takes_ends_the_program(example: str, words: str) -> None:
    controller = Controller(Options(start_delay=0.0))
    failed: list[str] = []
    controller.fail = lambda _, problem: failed.append(str(problem))  # type: ignore[method-assign]
    controller.load(translate(f"def p():\n{example}\nend\n", Builtins.functions()))
    for _ in range(6):
        controller.update()
    assert words in failed[0]
    assert controller.program is None


@pytest.mark.parametrize(
    "call",
    [
        'socket_open("192.0.2.1", 80)',
        'socket_open("example.org", 80)',
        "direct_torque([1, 0, 0, 0, 0, 0])",
        "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,9,0,0,0], 2, [1,1,1,1,1,1])",
    ],
)
def test_what_is_not_there_is_told_once_and_moves_nothing(call: str) -> None:
    controller = Controller(Options(start_delay=0.0))
    text = f"def p():\n  while True:\n    {call}\n    sync()\n  end\nend\n"
    controller.load(translate(text, Builtins.functions()))
    for _ in range(20):
        controller.update()
    assert ["not simulated" in str(notice) for notice in controller.notices].count(True) == 1
    assert not controller.arm.moving


def test_what_polyscope_writes_before_a_program_is_taken_and_clients_are_told_the_tools_modes() -> None:
    controller = Controller(Options(start_delay=0.0))
    text = """def cell():
  global _hidden_verificationVariable=0
  set_tool_communication(False, 115200, 0, 1, 1.5, 3.5)
  set_tool_output_mode(1)
  set_tool_digital_output_mode(0, 2)
  set_tool_digital_output_mode(1, 3)
  step_count_1 = 0.0
  thread Step_Counter_Thread_1():
    while (True):
      step_count_1 = step_count_1 + 1.0
      sync()
    end
  end
  run Step_Counter_Thread_1()
  set_standard_analog_input_domain(0, 1)
  set_tool_analog_input_domain(0, 1)
  set_analog_outputdomain(0, 0)
  set_input_actions_to_default()
  set_tool_voltage(0)
  set_gravity([0.0, 0.0, 9.82])
  set_safety_mode_transition_hardness(1)
  set_tcp(p[0.0,0.0,0.1,0.0,0.0,0.0])
  set_payload(0.5)
  while (True):
    $ 1 "Robot Program"
    $ 2 "Wait: 0.02"
    sleep(0.02)
  end
end
"""
    controller.load(translate(text, Builtins.functions()))
    for _ in range(30):
        controller.update()
    assert controller.program is not None
    outputs = RtdeOutputs(controller)
    names = ("tool_output_mode", "tool_digital_output0_mode", "tool_digital_output1_mode")
    assert [outputs.getter(name)() for name in names] == [1, 2, 3]


def page_table() -> str:
    """The page's list of functions, as this table has them."""
    lines = ["| subject | functions |", "|---|---|"]
    for subject, examples in EXAMPLES.items():
        names = sorted(examples.keys() - NO_EFFECT)
        if subject.startswith("not there"):  # groups of names with the same beginning
            for group in ("encoder", "modbus", "path", "set_runstate"):
                names = sorted({f"{group}_*" if name.startswith(f"{group}_") else name for name in names})
            beginnings = Counter(name.rpartition("_")[0] for name in names)
            names = sorted({f"{w}_*" if beginnings[w := name.rpartition("_")[0]] > 1 else name for name in names})
        lines.append(f"| {subject} | {' '.join(f'`{name}`' for name in names)} |")
    lines.append(f"| accepted, without an effect | {' '.join(f'`{name}`' for name in sorted(NO_EFFECT))} |")
    return "\n".join(lines)


def test_the_page_lists_every_function() -> None:
    text = PAGE.read_text(encoding="utf-8")
    shown = text.split("<!-- functions -->")[1].split("<!-- end of functions -->")[0]
    assert shown.strip() == page_table(), "python -m tests.robot.sim.machine.test_builtins prints the table anew"


if __name__ == "__main__":
    print(page_table())
