# SPDX-License-Identifier: BSD-3-Clause
"""WaveSculptor motor controller over CAN, as the EMRAX 228 coast-down recording names its columns.

Source: the controller's CAN messages (vectors of current, voltage and back-EMF; peak values) and the recording's own
description: n_rpm is the shaft speed, negative forward; vd_V, vq_V are the commanded voltages.  The signs are
consistent: u_q / omega_e is the positive magnet flux.
"""

NAME = "WaveSculptor"
SIGNATURE = {"id_a", "iq_a", "vd_v", "vq_v", "n_rpm"}
COLUMNS = {
    "t_s": ("t", "s"),
    "id_a": ("i_d", "A"),
    "iq_a": ("i_q", "A"),
    "vd_v": ("u_d_ref", "V"),
    "vq_v": ("u_q_ref", "V"),
    "n_rpm": ("omega_e", "rpm"),
    "u_dc_v": ("u_dc", "V"),
    "t_motor_c": ("temp_winding", "degC"),
}
