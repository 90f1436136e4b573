"""Program in the controller that follows joint velocity setpoints. Pure.

It moves an arm that another program moves otherwise. The setpoints come from the guard in every second control cycle,
through input registers (``setpoint_writer.py``). Each motion has a token of its own: the program ends where the
register holds another one, so that setpoints left from before move nothing. Where the guard falls silent, the
controller's own watchdog ends the program, and the arm brakes.
Source: UR script manual, read_input_float_register, rtde_set_watchdog, speedj.
"""

from __future__ import annotations

from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram

__all__ = ["REGISTERS", "program_text", "register_values"]

# All registers are of the half that is for clients of RTDE; ur_rtde uses the other half by default.
_SPEEDS = range(40, 46)  # double registers of the six joint speeds
_ACCELERATION = 46  # double register
_TOKEN = 47  # integer register
#: the controller's names of the registers, in the order of ``register_values``
REGISTERS = (
    f"input_int_register_{_TOKEN}",
    *(f"input_double_register_{number}" for number in (*_SPEEDS, _ACCELERATION)),
)


def register_values(setpoint: JointVelocitySetpoint) -> tuple[int | float, ...]:
    """Return what to write to ``REGISTERS`` for a setpoint."""
    return (setpoint.token, *setpoint.qd, setpoint.acceleration)


def program_text(program: SetpointProgram) -> str:
    """Return the URScript of the program that follows setpoints."""
    speeds = ", ".join(f"read_input_float_register({number})" for number in _SPEEDS)
    return (
        "def coneskin_follow():\n"
        f'  rtde_set_watchdog("{REGISTERS[0]}", {program.watchdog_hz:g}, "stop")\n'
        f"  while read_input_integer_register({_TOKEN}) == {program.token}:\n"
        f"    speedj([{speeds}], read_input_float_register({_ACCELERATION}), 0.002)\n"
        "  end\n"
        f"  stopj({program.deceleration:.3f})\n"
        "end\n"
    )
