# SPDX-License-Identifier: BSD-3-Clause
"""ODrive properties logged under their own names (firmware 0.5 and 0.6).

Source: ODrive's motor.hpp and foc.hpp: Id_measured, Iq_measured [A]; v_current_control_integral_d and _q [V] are
the integrators of the current controllers, equal to the voltage at steady operating points; a log over USB is too slow
for anything else.  vel_estimate and pos_vel_mapper.vel are shaft turns per second,
foc.phase_vel is electrical.
"""

from fluxproof.diagnosis.column_maps import last_part as KEY  # noqa: F401

NAME = "ODrive"
SIGNATURE = {"iq_measured", "id_measured"}
COLUMNS = {
    "t": ("t", "s"),
    "time": ("t", "s"),
    "timestamp": ("t", "s"),
    "id_measured": ("i_d", "A"),
    "iq_measured": ("i_q", "A"),
    "id_setpoint": ("i_d_ref", "A"),
    "iq_setpoint": ("i_q_ref", "A"),
    "v_current_control_integral_d": ("u_d_ref", "V"),
    "v_current_control_integral_q": ("u_q_ref", "V"),
    "vel_estimate": ("omega_e", "turn/s mech"),
    "vel": ("omega_e", "turn/s mech"),
    "phase_vel": ("omega_e", "rad/s"),
    "vbus_voltage": ("u_dc", "V"),
}
IGNORED = {"torque": "the controller computes it from i_q", "torque_estimate": "the controller computes it from i_q"}
NOTES = ["ODrive: the voltages are the current controllers' integrators; only steady operating points are used"]
