"""Program in the controller that follows joint velocity setpoints. Pure.

It moves an arm that another program moves otherwise. The setpoints come from the guard in every second control cycle,
through input registers (``setpoint_writer.py``). Each motion has a token of its own: the program ends where the
register holds another one, so that setpoints left from before move nothing. Where the guard falls silent, the
controller's own watchdog ends the program, and the arm brakes.
Source: UR script manual, read_input_float_register, rtde_set_watchdog, speedj.
"""

from __future__ import annotations

from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram

__all__ = ["SETPOINT_INPUTS", "program_text"]

# All registers are of the half that is for clients of RTDE; ur_rtde uses the other half by default.
_SPEED_REGISTERS = range(40, 46)  # double registers of the six joint speeds
_ACCELERATION_REGISTER = 46  # double register
_TOKEN_REGISTER = 47  # integer register
#: the controller's names of the registers, in the order of ``_register_values``
SETPOINT_INPUTS = (
    f"input_int_register_{_TOKEN_REGISTER}",
    *(f"input_double_register_{number}" for number in (*_SPEED_REGISTERS, _ACCELERATION_REGISTER)),
)


def _register_values(setpoint: JointVelocitySetpoint) -> tuple[int | float, ...]:
    """Return what to write to ``SETPOINT_INPUTS`` for a setpoint."""
    return (setpoint.token, *setpoint.qd, setpoint.acceleration)


def program_text(program: SetpointProgram) -> str:
    """Return the URScript of the program that follows setpoints."""
    speeds = ", ".join(f"read_input_float_register({number})" for number in _SPEED_REGISTERS)
    return (
        "def coneskin_follow():\n"
        f'  rtde_set_watchdog("{SETPOINT_INPUTS[0]}", {program.watchdog_hz:g}, "stop")\n'
        f"  while read_input_integer_register({_TOKEN_REGISTER}) == {program.token}:\n"
        f"    speedj([{speeds}], read_input_float_register({_ACCELERATION_REGISTER}), 0.002)\n"
        "  end\n"
        f"  stopj({program.deceleration:.3f})\n"
        "end\n"
    )
