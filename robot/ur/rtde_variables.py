"""Variables of RTDE: the table of their names and types on the wire.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide"; confirmed against ur_rtde 1.6.5, which decodes by its
own table of names.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["VARIABLES", "WIRE_TYPES"]

#: type on the wire -> (code of the struct module, number of values)
WIRE_TYPES: Mapping[str, tuple[str, int]] = {
    "DOUBLE": ("d", 1),
    "INT32": ("i", 1),
    "UINT32": ("I", 1),
    "UINT64": ("Q", 1),
    "UINT8": ("B", 1),
    "BOOL": ("?", 1),
    "VECTOR3D": ("d", 3),
    "VECTOR6D": ("d", 6),
    "VECTOR6INT32": ("i", 6),
    "VECTOR6UINT32": ("I", 6),
}


def _table() -> dict[str, str]:
    names = {
        "VECTOR6D": """target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current
            actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed
            actual_TCP_force target_TCP_pose target_TCP_speed actual_TCP_acceleration target_TCP_acceleration
            tcp_offset joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents payload_inertia
            target_base_acceleration target_base_wrench external_force_torque""",
        "VECTOR3D": "actual_tool_accelerometer payload_cog elbow_position elbow_velocity target_gravity",
        "VECTOR6INT32": "joint_mode",
        "UINT64": """actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits
            actual_configurable_digital_output_bits control_step""",
        "UINT32": """runtime_state robot_status_bits safety_status_bits script_control_line speed_slider_mask
            analog_io_types tool_mode tool_analog_input_types euromap67_input_bits euromap67_output_bits
            output_bit_registers0_to_31 output_bit_registers32_to_63 input_bit_registers0_to_31
            input_bit_registers32_to_63""",
        "INT32": """robot_mode safety_mode safety_status tool_output_voltage time_scale_source encoder0_raw
            encoder1_raw""",
        "UINT8": """standard_digital_output_mask standard_digital_output configurable_digital_output_mask
            configurable_digital_output tool_digital_output_mask tool_digital_output standard_analog_output_mask
            standard_analog_output_type tool_output_mode tool_digital_output0_mode tool_digital_output1_mode""",
        "DOUBLE": """timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction
            speed_slider_fraction actual_momentum actual_main_voltage actual_robot_voltage actual_robot_current
            actual_robot_energy_consumed actual_robot_braking_energy_dissipated tcp_force_scalar
            standard_analog_input0 standard_analog_input1 standard_analog_output0 standard_analog_output1
            standard_analog_output_0 standard_analog_output_1 tool_analog_input0 tool_analog_input1
            tool_output_current tool_temperature io_current euromap67_24V_voltage euromap67_24V_current payload
            joint_position_deviation_ratio collision_detection_ratio""",
    }
    table = {name: kind for kind, words in names.items() for name in words.split()}
    for direction in ("input", "output"):
        for index in range(48):
            table[f"{direction}_int_register_{index}"] = "INT32"
            table[f"{direction}_double_register_{index}"] = "DOUBLE"
        for index in range(64, 128):  # 0-63 travel as the two words input_bit_registers*
            table[f"{direction}_bit_register_{index}"] = "BOOL"
    return table


#: name of each variable -> its type on the wire
VARIABLES: Mapping[str, str] = MappingProxyType(_table())
