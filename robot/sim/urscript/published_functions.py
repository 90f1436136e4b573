"""Published URScript functions that this simulation does not have: a program that calls one is refused by its name.

Source: Universal Robots, "The URScript Programming Language" (5.25), lists of functions of all modules.
"""

from __future__ import annotations

__all__ = ["NOT_SIMULATED"]

_BY_SUBJECT = {
    "field buses": """modbus_add_rw_signal modbus_add_signal modbus_delete_signal modbus_get_error
        modbus_get_signal_status modbus_get_time_since_signal_invalid modbus_reset_connection
        modbus_send_custom_command modbus_set_digital_input_action modbus_set_output_register modbus_set_output_signal
        modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency modbus_set_signal_watchdog
        read_port_bit read_port_register write_port_bit write_port_register get_euromap_input get_euromap_output
        set_euromap_output set_euromap_runstate_dependent_choice get_rtde_value rpc_factory
        request_boolean_from_primary_client request_float_from_primary_client request_integer_from_primary_client
        request_string_from_primary_client""",
    "outputs that follow the state of a program": """set_runstate_configurable_digital_output_to_value
        set_runstate_gp_boolean_output_to_value set_runstate_standard_analog_output_to_value
        set_runstate_standard_digital_output_to_value set_runstate_tool_digital_output_to_value""",
    "conveyors": """conveyor_pulse_decode encoder_enable_pulse_decode encoder_enable_set_tick_count
        encoder_get_tick_count encoder_set_tick_count encoder_unwind_delta_tick_count get_conveyor_tick_count
        set_conveyor_tick_count stop_conveyor_tracking track_conveyor_circular track_conveyor_linear""",
    "offsets of paths": """path_offset_disable path_offset_enable path_offset_get path_offset_set
        path_offset_set_alpha_filter path_offset_set_max_offset""",
    "motion that this arm has not": """jerk_gain_scaling_get jerk_gain_scaling_set motion_version_get
        motion_version_set pause_on_error_code position_deviation_warning reset_revolution_counter
        tool_wrench_limit_disable tool_wrench_limit_set screw_driving end_screw_driving""",
    "the rest": """estimate_payload get_base_acceleration set_base_acceleration high_holding_torque_disable
        high_holding_torque_enable powerdown set_baselight_iec set_baselight_off set_baselight_solid time""",
}

#: name of each function -> its subject
NOT_SIMULATED: dict[str, str] = {name: subject for subject, names in _BY_SUBJECT.items() for name in names.split()}
