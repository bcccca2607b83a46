# SPDX-License-Identifier: BSD-3-Clause
"""VESC Tool's realtime log (CSV, separated by semicolons).

Source: the header of VESC Tool and compatible loggers, "ms_today;input_voltage;...;d_axis_voltage;
q_axis_voltage;...".  Currents and voltages are peak values in an amplitude-invariant dq frame, averaged since the last
message; erpm is electrical.  A log has 10 to 50 rows per second: operating points only.
"""

NAME = "VESC Tool"
SIGNATURE = {"ms_today", "erpm", "d_axis_current", "q_axis_current"}
COLUMNS = {
    "ms_today": ("t", "ms"),
    "d_axis_current": ("i_d", "A"),
    "q_axis_current": ("i_q", "A"),
    "d_axis_voltage": ("u_d_ref", "V"),
    "q_axis_voltage": ("u_q_ref", "V"),
    "erpm": ("omega_e", "erpm"),
    "input_voltage": ("u_dc", "V"),
    "temp_motor": ("temp_winding", "degC"),
}
