# SPDX-License-Identifier: BSD-3-Clause
"""Values of a VESC as pyvesc and similar clients name them.

Source: github.com/LiamBindle/PyVESC, the message GetValues (COMM_GET_VALUES of the firmware): ``rpm`` is electrical;
``avg_id`` and ``avg_iq`` [A] are peak values, ``v_in`` [V] is the bus.  Newer firmware adds the dq voltages, here
``avg_vd`` and ``avg_vq``.
"""

from fluxproof.diagnosis.column_maps import last_part as KEY  # noqa: F401

NAME = "pyvesc"
SIGNATURE = {"avg_id", "avg_iq", "rpm"}
COLUMNS = {
    "t": ("t", "s"),
    "time": ("t", "s"),
    "timestamp": ("t", "s"),
    "avg_id": ("i_d", "A"),
    "avg_iq": ("i_q", "A"),
    "avg_vd": ("u_d_ref", "V"),
    "avg_vq": ("u_q_ref", "V"),
    "rpm": ("omega_e", "erpm"),
    "v_in": ("u_dc", "V"),
    "temp_motor": ("temp_winding", "degC"),
}
