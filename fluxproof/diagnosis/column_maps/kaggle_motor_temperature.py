# SPDX-License-Identifier: BSD-3-Clause
"""Kaggle "Electric Motor Temperature", measures_v2.csv: 185 h of a 52 kW PMSM on a test bench at 2 Hz.

Source: the data set's page (W. Kirchgässner, O. Wallscheid, J. Böcker, Paderborn University): u_d, u_q [V], i_d, i_q
[A], motor_speed [1/min] of the shaft, torque [Nm], temperatures [degC]; profile_id numbers the sessions; no
time column, two rows per second; no bus voltage.
"""

NAME = "Kaggle electric motor temperature"
SIGNATURE = {"motor_speed", "stator_winding", "u_d", "u_q", "i_d", "i_q", "profile_id"}
COLUMNS = {
    "u_d": ("u_d_ref", "V"),
    "u_q": ("u_q_ref", "V"),
    "i_d": ("i_d", "A"),
    "i_q": ("i_q", "A"),
    "motor_speed": ("omega_e", "rpm"),
    "stator_winding": ("temp_winding", "degC"),
    "torque": ("torque", "Nm"),
}
SAMPLE_TIME_S = 0.5
RUN = "profile_id"
