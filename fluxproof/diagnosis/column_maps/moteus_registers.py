# SPDX-License-Identifier: BSD-3-Clause
"""moteus registers as its Python library names them.

Source: github.com/mjbots/moteus, the register list of its protocol: velocity in turns of the output shaft a
second, D_CURRENT, Q_CURRENT [A], VOLTAGE (bus), VOLTAGE_DQ_D, VOLTAGE_DQ_Q [V], MOTOR_TEMPERATURE [degC].
"""

from fluxproof.diagnosis.column_maps import last_part as KEY  # noqa: F401

NAME = "moteus registers"
SIGNATURE = {"d_current", "q_current", "velocity"}
COLUMNS = {
    "timestamp": ("t", "s"),
    "time": ("t", "s"),
    "time_s": ("t", "s"),
    "t": ("t", "s"),
    "d_current": ("i_d", "A"),
    "q_current": ("i_q", "A"),
    "voltage_dq_d": ("u_d_ref", "V"),
    "voltage_dq_q": ("u_q_ref", "V"),
    "command_d_current": ("i_d_ref", "A"),
    "command_q_current": ("i_q_ref", "A"),
    "velocity": ("omega_e", "turn/s mech"),
    "voltage": ("u_dc", "V"),
    "motor_temperature": ("temp_winding", "degC"),
}
IGNORED = {"torque": "the controller computes it from i_q"}
NOTES = ["moteus: velocity is that of the output shaft; with a gear the electrical speed is higher by its ratio"]
