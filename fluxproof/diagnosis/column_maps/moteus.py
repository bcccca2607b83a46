# SPDX-License-Identifier: BSD-3-Clause
"""moteus telemetry: the channels servo_stats and servo_control, or the registers of its Python library.

Source: github.com/mjbots/moteus, fw/bldc_servo_structs.h (BldcServoStatus: d_A, q_A, electrical_theta, velocity,
bus_V, motor_temp_C; BldcServoControl: d_V, q_V) and docs/protocol/registers.  Position and velocity are turns of
the output shaft: with a gear, give the motor's speed in [columns] instead.
"""

from fluxproof.diagnosis.column_maps import last_part as KEY  # noqa: F401

NAME = "moteus"
SIGNATURE = {"d_a", "q_a", "d_v", "q_v"}
COLUMNS = {
    "timestamp": ("t", "s"),
    "time": ("t", "s"),
    "time_s": ("t", "s"),
    "t": ("t", "s"),
    "d_a": ("i_d", "A"),
    "q_a": ("i_q", "A"),
    "d_v": ("u_d_ref", "V"),
    "q_v": ("u_q_ref", "V"),
    "i_d_a": ("i_d_ref", "A"),
    "i_q_a": ("i_q_ref", "A"),
    "electrical_theta": ("theta_e", "rad"),
    "velocity": ("omega_e", "turn/s mech"),
    "bus_v": ("u_dc", "V"),
    "motor_temp_c": ("temp_winding", "degC"),
}
IGNORED = {"torque": "the controller computes it from i_q", "torque_nm": "the controller computes it from i_q"}
NOTES = ["moteus: velocity is that of the output shaft; with a gear the electrical speed is higher by its ratio"]
