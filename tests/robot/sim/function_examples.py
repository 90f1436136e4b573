"""One example of each URScript function of the simulated controller; docs/look-up/sim-ur.md lists them by this table.

An example is a program whose last line must be True. Many are those of "The URScript Programming Language".
"""

from __future__ import annotations

from coneskin.robot.sim.machine import io_functions
from coneskin.robot.sim.urscript.values import PoseValue, show

_Q = "[0.1, -1.4, 1.5, -1.7, -1.4, 0.2]"
_LEVEL = "get_actual_tcp_pose()"


def _written(answer: object) -> str:
    return "p[0, 0, 0, 0, 0, 0]" if isinstance(answer, PoseValue) else show(answer)


NO_EFFECT = frozenset([*io_functions.NO_EFFECT, "force_mode"])  # a wanted force is told

#: subject -> name of a function -> example
EXAMPLES: dict[str, dict[str, str]] = {
    "motion": {
        "direct_torque": "direct_torque([0, 0, 0, 0, 0, 0], friction_comp=False)\nis_steady()",
        "movec": f"a = {_LEVEL}\nmovec(pose_add(a, p[0, 0, 0.01, 0, 0, 0]), pose_add(a, p[0, 0.01, 0.01, 0, 0, 0]))\n"
        f"point_dist({_LEVEL}, a) > 0.014",
        "movej": f"movej({_Q}, a=5, v=2)\nnorm(get_actual_joint_positions() - {_Q}) < 1e-9",
        "movel": f"a = pose_add({_LEVEL}, p[0, 0, 0.02, 0, 0, 0])\nmovel(a, v=0.5)\npoint_dist({_LEVEL}, a) < 1e-9",
        "movep": f"a = pose_add({_LEVEL}, p[0, 0, 0.02, 0, 0, 0])\nmovep(a, v=0.5)\npoint_dist({_LEVEL}, a) < 1e-9",
        "optimovej": f"optimovej({_Q}, a=1, v=0.5)\nnorm(get_actual_joint_positions() - {_Q}) < 1e-9",
        "optimovel": f"a = pose_add({_LEVEL}, p[0, 0, 0.02, 0, 0, 0])\noptimovel(a)\npoint_dist({_LEVEL}, a) < 1e-9",
        "set_pos": "set_pos([0, -1.2, 1.2, 0, 0, 0])\nget_actual_joint_positions() == [0, -1.2, 1.2, 0, 0, 0]",
        "servoc": f"a = {_LEVEL}\nservoc(a)\npoint_dist({_LEVEL}, a) < 1e-3",
        "servoj": "q = get_actual_joint_positions()\nq[0] = q[0] + 0.01\nservoj(q, t=0.1)\n"
        "norm(get_actual_joint_positions() - q) < 0.01",
        "speedj": "speedj([0.2, 0, 0, 0, 0, 0], 2)\nnorm(get_actual_joint_speeds()) > 0.19",
        "speedl": "speedl([0, 0, 0.05, 0, 0, 0], 1)\nnorm(get_actual_tcp_speed() - [0, 0, 0.05, 0, 0, 0]) < 1e-3",
        "stopj": "speedj([0.2, 0, 0, 0, 0, 0], 2)\nstopj(2)\nis_steady()",
        "stopl": "speedl([0, 0, 0.05, 0, 0, 0], 1)\nstopl(1)\nis_steady()",
    },
    "forces, of an arm that nothing touches": {
        "enable_external_ft_sensor": "enable_external_ft_sensor(True)\nforce() == 0",
        "end_force_mode": "end_force_mode()\nTrue",
        "end_freedrive_mode": "end_freedrive_mode()\nTrue",
        "end_teach_mode": "end_teach_mode()\nTrue",
        "force": "force() == 0",
        "force_mode": "force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], 2, [1, 1, 1, 1, 1, 1])\n"
        "is_steady()",
        "force_mode_get_damping": "force_mode_get_damping() == 0.025",
        "force_mode_get_gain_scaling": "force_mode_get_gain_scaling() == 1",
        "force_mode_set_damping": "force_mode_set_damping(0.5)\nforce_mode_get_damping() == 0.5",
        "force_mode_set_gain_scaling": "force_mode_set_gain_scaling(3)\nforce_mode_get_gain_scaling() == 2",
        "freedrive_mode": "freedrive_mode(freeAxes=[1, 0, 0, 0, 0, 0])\nis_steady()",
        "freedrive_mode_no_incorrect_payload_check": "freedrive_mode_no_incorrect_payload_check()\nis_steady()",
        "ft_rtde_input_enable": "ft_rtde_input_enable(True, 0.5, [0, 0, 0], [0, 0, 0])\nforce() == 0",
        "get_freedrive_status": "get_freedrive_status() == 0",
        "get_gravity": "norm(get_gravity()) == 9.82",
        "get_tcp_force": "norm(get_tcp_force()) == 0",
        "set_gravity": "set_gravity([0, 9.82, 0])\nget_gravity() == [0, 9.82, 0]",
        "teach_mode": "teach_mode()\nis_steady()",
        "tool_contact": "tool_contact(direction=get_actual_tcp_speed()) == 0",
        "zero_ftsensor": "zero_ftsensor()\nforce() == 0",
    },
    "state of the arm": {
        "get_actual_joint_accelerations": "norm(get_actual_joint_accelerations()) == 0",
        "get_actual_joint_positions": "length(get_actual_joint_positions()) == 6",
        "get_actual_joint_positions_history": (
            "speedj([0.5, 0, 0, 0, 0, 0], 5, 0.1)\n"
            "before = get_actual_joint_positions()\n"
            "sync()\n"
            "sync()\n"
            "get_actual_joint_positions_history(2) == before and before != get_actual_joint_positions()"
        ),
        "get_actual_joint_speeds": "norm(get_actual_joint_speeds()) == 0",
        "get_actual_tcp_pose": "pose_dist(get_actual_tcp_pose(), get_forward_kin()) == 0",
        "get_actual_tcp_speed": "norm(get_actual_tcp_speed()) == 0",
        "get_actual_tool_flange_pose": "set_tcp(p[0, 0, 0.1, 0, 0, 0])\n"
        "norm(point_dist(get_actual_tool_flange_pose(), get_actual_tcp_pose()) - 0.1) < 1e-9",
        "get_controller_temp": "get_controller_temp() == 30",
        "get_forward_kin": f"norm(get_inverse_kin(get_forward_kin({_Q}), {_Q}) - {_Q}) < 1e-6",
        "get_inverse_kin": f"norm(get_inverse_kin({_LEVEL}) - get_actual_joint_positions()) < 1e-6",
        "get_inverse_kin_has_solution": f"get_inverse_kin_has_solution({_LEVEL})\n"
        "not get_inverse_kin_has_solution(p[9, 0, 0, 0, 0, 0])",
        "get_jacobian": "size(get_jacobian()) == 6\n"
        "norm(get_jacobian([0, -1.2, 1.2, 0, 0, 0])[0] - get_jacobian([0, -1.2, 1, 0, 0, 0])[0]) > 0.01",
        "get_jacobian_time_derivative": "size(get_jacobian_time_derivative()) == 6",
        "get_joint_positions": "get_joint_positions() == get_actual_joint_positions()",
        "get_joint_temp": "get_joint_temp(5) == 30",
        "get_steptime": "get_steptime() == 0.002",
        "get_target_joint_accelerations": "norm(get_target_joint_accelerations()) == 0",
        "get_target_joint_positions": "get_target_joint_positions() == get_actual_joint_positions()",
        "get_target_joint_speeds": "norm(get_target_joint_speeds()) == 0",
        "get_target_tcp_pose": f"get_target_tcp_pose() == {_LEVEL}",
        "get_target_tcp_pose_along_path": f"get_target_tcp_pose_along_path() == {_LEVEL}",
        "get_target_tcp_speed_along_path": "norm(get_target_tcp_speed_along_path()) == 0",
        "get_target_tcp_speed": "norm(get_target_tcp_speed()) == 0",
        "get_target_waypoint": f"get_target_waypoint() == {_LEVEL}",
        "tool_pose": f"tool_pose() == {_LEVEL}",
        "get_tcp_offset": "set_tcp(p[0, 0, 0.1, 0, 0, 0])\nget_tcp_offset() == p[0, 0, 0.1, 0, 0, 0]",
        "get_tool_accelerometer_reading": "length(get_tool_accelerometer_reading()) == 3",
        "get_tool_current": "get_tool_current() == 0",
        "get_tool_temp": "get_tool_temp() == 30",
        "is_steady": "is_steady()",
        "is_within_safety_limits": f"is_within_safety_limits({_Q})",
        "set_tcp": 'set_tcp(p[0, 0, 0.1, 0, 0, 0], "tool")\nget_tcp_offset()[2] == 0.1',
    },
    "dynamics of the bare arm": {
        "get_coriolis_and_centrifugal_torques": "norm(get_coriolis_and_centrifugal_torques()) == 0 and "
        "norm(get_coriolis_and_centrifugal_torques([0, -1.2, 1.2, 0, 0, 0], [1, 1, 0, 0, 0, 0])) > 0.1",
        "get_mass_matrix": "a = get_mass_matrix()\n"
        "b = get_mass_matrix(include_rotors_inertia=True)\na[0, 1] == a[1, 0] and b[5, 5] > a[5, 5] and a[5, 5] > 0",
    },
    "not a number, for nothing touches the arm": {
        "get_joint_torques": "a = get_joint_torques()\na[0] != a[0]",
    },
    "payload": {
        "get_target_payload": "set_payload(2)\nget_target_payload() == 2",
        "get_target_payload_cog": "set_payload(2, [0, 0, 0.1])\nget_target_payload_cog() == [0, 0, 0.1]",
        "get_target_payload_inertia": "set_target_payload(2, [0, 0, 0], [1, 2, 3, 0, 0, 0])\n"
        "get_target_payload_inertia() == [1, 2, 3, 0, 0, 0]",
        "set_payload": "set_target_payload(2, [0, 0, 0.1], [1, 2, 3, 0, 0, 0])\nset_payload(3)\n"
        "norm(get_target_payload_inertia()) == 0 and get_target_payload_cog() == [0, 0, 0.1]",
        "set_payload_cog": "set_payload_cog([0, 0, 0.2])\nget_target_payload_cog() == [0, 0, 0.2]",
        "set_payload_mass": "set_payload_mass(4)\nget_target_payload() == 4",
        "set_target_payload": "set_target_payload(2, [0, 0, 0.1], transition_time=1)\nget_target_payload() == 2",
    },
    "installation, as PolyScope writes it before a program": {
        "set_configurable_digital_input_action": 'set_configurable_digital_input_action(7, "freedrive")\nTrue',
        "set_analog_inputrange": "set_analog_inputrange(0, 0)\nTrue",
        "varmsg": 'varmsg("x", 1)\nTrue',
        "set_gp_boolean_input_action": 'set_gp_boolean_input_action(127, "default")\nTrue',
        "set_input_actions_to_default": "set_input_actions_to_default()\nTrue",
        "set_safety_mode_transition_hardness": "set_safety_mode_transition_hardness(1)\nTrue",
        "set_standard_digital_input_action": 'set_standard_digital_input_action(0, "freedrive")\nTrue',
        "set_tool_communication": "set_tool_communication(False, 115200, 0, 1, 1.5, 3.5)\nTrue",
        "set_tool_digital_input_action": 'set_tool_digital_input_action(1, "default")\nTrue',
        "set_tool_digital_output_mode": "set_tool_digital_output_mode(1, 3)\nTrue",
        "set_tool_output_mode": "set_tool_output_mode(1)\nTrue",
    },
    "inputs, outputs and registers": {
        "get_analog_in": "get_analog_in(3) == 0",
        "get_analog_out": "set_analog_out(1, 0.5)\nget_analog_out(1) == 0.5",
        "get_configurable_digital_in": "get_configurable_digital_in(7) == False",
        "get_configurable_digital_out": "set_configurable_digital_out(7, True)\nget_configurable_digital_out(7)",
        "get_digital_in": "get_digital_in(17) == False",
        "get_digital_out": "set_tool_digital_out(1, True)\nget_digital_out(17)",
        "get_rtde_value": 'get_rtde_value("actual_q") == get_joint_positions() and get_rtde_value("timestamp") > 0',
        "get_flag": "get_flag(31) == False",
        "get_standard_analog_in": "get_standard_analog_in(1) == 0",
        "get_standard_analog_out": "get_standard_analog_out(0) == 0",
        "get_standard_digital_in": "get_standard_digital_in(7) == False",
        "get_standard_digital_out": "get_standard_digital_out(7) == False",
        "get_tool_analog_in": "get_tool_analog_in(1) == 0",
        "get_tool_digital_in": "get_tool_digital_in(1) == False",
        "get_tool_digital_out": "get_tool_digital_out(1) == False",
        "read_input_boolean_register": "read_input_boolean_register(127) == False",
        "read_input_float_register": "read_input_float_register(47) == 0",
        "read_input_integer_register": "read_input_integer_register(47) == 0",
        "read_output_boolean_register": "write_output_boolean_register(40, True)\nread_output_boolean_register(40)",
        "read_output_float_register": "write_output_float_register(40, 1.5)\nread_output_float_register(40) == 1.5",
        "read_output_integer_register": "write_output_integer_register(40, 7)\nread_output_integer_register(40) == 7",
        "rtde_set_watchdog": 'rtde_set_watchdog("input_int_register_0", 10, "stop")\nTrue',
        "set_analog_out": "set_analog_out(0, 1)\nget_standard_analog_out(0) == 1",
        "set_analog_outputdomain": "set_analog_outputdomain(0, 0)\nTrue",
        "set_configurable_digital_out": "set_configurable_digital_out(0, True)\nget_digital_out(8)",
        "set_digital_out": "set_digital_out(16, True)\nget_tool_digital_out(0)",
        "set_flag": "set_flag(1, True)\nget_flag(1)",
        "set_standard_analog_input_domain": "set_standard_analog_input_domain(0, 1)\nTrue",
        "set_standard_analog_out": "set_standard_analog_out(1, 0.25)\nget_analog_out(1) == 0.25",
        "set_standard_digital_out": "set_standard_digital_out(0, True)\nget_digital_out(0)",
        "set_tool_analog_input_domain": "set_tool_analog_input_domain(1, 0)\nTrue",
        "set_tool_digital_out": "set_tool_digital_out(0, True)\nget_tool_digital_out(0)",
        "set_tool_voltage": "set_tool_voltage(24)\nTrue",
        "write_output_boolean_register": "write_output_boolean_register(127, True)\nread_output_boolean_register(127)",
        "write_output_float_register": "write_output_float_register(0, 2)\nread_output_float_register(0) == 2",
        "write_output_integer_register": "write_output_integer_register(1, 2)\nread_output_integer_register(1) == 2",
    },
    "not there: answered as by a device that is not connected, and told to the clients once": {
        "eip_reader_factory": 'eip_reader_factory("101", 8).read("door") == 0',
        "eip_writer_factory": 'eip_writer_factory("111", 8).define_bit(0, 1, "door") == 0',
        "modbus_add_signal": 'modbus_add_signal("192.168.1.9", 255, 0, 0, "in", True, 3)\n'
        'modbus_get_signal_status("in") == [False, False, False]',
        "modbus_add_rw_signal": 'modbus_add_rw_signal("192.168.1.9", 255, 5, 2, 15, 2, "a")\n'
        'modbus_get_signal_status("a") == [0, 0]',
        "modbus_get_signal_status": 'modbus_add_signal("192.168.1.9", 255, 0, 2, "in")\n'
        'modbus_get_signal_status("in", False) == 0',
        "modbus_get_error": 'modbus_get_error("in") == -0x20000',
        **{
            name: f"{name}(0) == {_written(answer)}"
            for answer, names in io_functions._ABSENT_DEVICES[1:]
            for name in names.split()
        },
    },
    "sockets": {
        # where no server listens; those that send and read have tests of their own
        "rpc_factory": 'rpc_factory("xmlrpc", "http://127.0.0.1:1/RPC2").closeXMLRPCClientConnection() == None',
        "socket_close": "socket_close()\nTrue",
        "socket_get_var": 'socket_get_var("x") == 0',
        "socket_open": 'socket_open("127.0.0.1", 1) == False and socket_open("192.0.2.1", 80) == False',
        "socket_read_ascii_float": 'socket_read_ascii_float(2, "a", 0.01)[0] == 0',
        "socket_read_binary_integer": 'socket_read_binary_integer(2, "a", 0.01) == [0, -1, -1]',
        "socket_read_byte_list": 'socket_read_byte_list(2, "a", 0.01) == [0, -1, -1]',
        "socket_read_line": 'socket_read_line("a", 0.01) == ""',
        "socket_read_string": 'str_empty(socket_read_string("a", timeout=0.01))',
        "socket_send_byte": "not socket_send_byte(1)",
        "socket_send_byte_list": "not socket_send_byte_list([1, 2])",
        "socket_send_int": "not socket_send_int(1)",
        "socket_send_line": 'not socket_send_line("a")',
        "socket_send_string": 'not socket_send_string("a")',
        "socket_set_var": 'socket_set_var("x", 1)\nTrue',
    },
    "texts": {
        "str_at": 'str_at("Hello", 1) == "e"',
        "str_cat": 'str_cat([True, False], p[1.0, 2.5, 3, 4, 5, 6]) == "[True, False]p[1, 2.5, 3, 4, 5, 6]"',
        "str_empty": 'str_empty("") and not str_empty("Hello")',
        "str_find": 'str_find("Hello World!", "o", 5) == 7 and str_find("abc", "z") == -1',
        "str_len": 'str_len("Hello") == 5',
        "str_sub": 'str_cat(str_sub("0123456789abc", 5, 3), str_sub("abcde", 2, 50)) == "567cde"',
        "to_num": 'to_num("-3.5") + to_num("4") == 0.5',
        "to_str": 'to_str(2.123456123456) == "2.123456" and to_str(p[1.0, 2.0, 3, 4, 5, 6]) == "p[1, 2, 3, 4, 5, 6]"',
    },
    "time and messages": {
        "interpreter_mode": "thread t():\nend_interpreter()\nend\nrun t()\ninterpreter_mode()\nTrue",
        "end_interpreter": "end_interpreter()\nTrue",
        "clear_interpreter": "clear_interpreter()\nTrue",
        "popup": 'popup("here", title="Popup #1", blocking=False)\npopup("a", "b", False, True, True)\nTrue',
        **{
            f"request_{kind}_from_primary_client": f"thread t():\nrequest_{kind}_from_primary_client('a')\n"
            "write_output_integer_register(1, 1)\nend\nrun t()\nsleep(0.1)\nread_output_integer_register(1) == 0"
            for kind in ("boolean", "float", "integer", "string")  # nobody answers
        },
        "protective_stop": "not False or protective_stop()",  # it would not return: see test_safety_system.py
        "sleep": "sleep(0.01)\nTrue",
        "sync": "sync()\nTrue",
        "textmsg": 'textmsg("value=", 3)\nTrue',
    },
    "mathematics": {
        "wrench_trans": "a = wrench_trans(p[0, 0, 0.5, 0, 0, d2r(90)], [2, 0, 0, 0, 0, 3])\n"
        "norm(a - [0, -2, 0, -1, 0, 3]) < 1e-9",
        "acos": "norm(acos(0.5) - d2r(60)) < 1e-9",
        "asin": "norm(asin(0.5) - d2r(30)) < 1e-9",
        "atan": "norm(atan(1) - d2r(45)) < 1e-9",
        "atan2": "norm(atan2(-1, 0) + d2r(90)) < 1e-9",
        "binary_list_to_integer": "binary_list_to_integer([True, False, False, True]) == 9",
        "ceil": "ceil(1.43) == 2",
        "cos": "norm(cos(1.57079632679)) < 1e-9",
        "d2r": "norm(d2r(180) - 3.14159265359) < 1e-9",
        "floor": "floor(1.53) == 1",
        "get_list_length": "get_list_length([1, 3, 3, 6, 2]) == 5",
        "integer_to_binary_list": "binary_list_to_integer(integer_to_binary_list(-7)) == -7",
        "interpolate_pose": "point_dist(interpolate_pose(p[0.2, 0.2, 0.4, 0, 0, 0], p[0.2, 0.2, 0.6, 0, 0, 0], 0.5), "
        "p[0.2, 0.2, 0.5, 0, 0, 0]) < 1e-9",
        "inv": "pose_dist(pose_trans(inv(get_forward_kin()), get_forward_kin()), p[0, 0, 0, 0, 0, 0]) < 1e-9\n"
        "inv([[0, 2], [1, 1]]) == [[-0.5, 1], [0.5, 0]]",
        "length": "length(p[1, 2, 3, 4, 5, 6]) == 6",
        "log": "log(2, 4) == 2",
        "make_list": "make_list(3, 1.5, 5) == [1.5, 1.5, 1.5]",
        "norm": "norm([3, 4]) == 5",
        "normalize": "norm(normalize([1, 2, 2]) - [1 / 3, 2 / 3, 2 / 3]) < 1e-9",
        "point_dist": "norm(point_dist(p[0.2, 0.5, 0.1, 1.57, 0, 3.14], p[0.2, 0.5, 0.6, 0, 1.57, 3.14]) - 0.5) < 1e-9",
        "pose_add": "pose_add(p[1, 2, 3, 0, 0, 0], p[1, 1, 1, 0, 0, 0]) == p[2, 3, 4, 0, 0, 0]",
        "pose_dist": "pose_dist(p[0, 0, 0, 0, 0, 0], p[0, 0, 0, 0, 0.3, 0]) < 0.3001",
        "pose_inv": "pose_inv(p[1, 2, 3, 0, 0, 0]) == p[-1, -2, -3, 0, 0, 0]",
        "pose_sub": "norm(pose_sub(p[1, 2, 3, 0, 0, 0.2], p[1, 1, 1, 0, 0, 0.1]) - [0, 1, 2, 0, 0, 0.1]) < 1e-9",
        "pose_trans": "norm(pose_trans(p[0, 0, 0, 0, 0, d2r(90)], p[1, 0, 0, 0, 0, 0]) - [0, 1, 0, 0, 0, d2r(90)]) "
        "< 1e-9",
        "pow": "pow(5, 3) == 125",
        "r2d": "norm(r2d(1.57079632679) - 90) < 1e-6",
        "random": "a = random()\na >= 0 and a < 1 and a != random()",
        "rotvec2rpy": "norm(rotvec2rpy([3.14, 1.57, 0]) - [-2.80856, -0.16202, 0.9]) < 2e-3",
        "rpy2rotvec": "norm(rotvec2rpy(rpy2rotvec([0.3, -0.2, 0.5])) - [0.3, -0.2, 0.5]) < 1e-9",
        "sin": "norm(sin(1.57079632679) - 1) < 1e-9",
        "size": "size([1, 2]) == 2",
        "sqrt": "sqrt(9) == 3",
        "tan": "norm(tan(d2r(45)) - 1) < 1e-9",
        "transpose": "transpose([[1, 2], [3, 4]]) == [[1, 3], [2, 4]]",
    },
}
