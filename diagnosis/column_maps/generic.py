"""Common names of the canonical signals, including dSPACE ControlDesk exports.

ControlDesk names a variable by its path in the model ("Model Root/Current control/i_a"); the last part is used unless
it is generic, such as Out1.  Only unambiguous names are listed.
"""

from fluxproof.diagnosis.column_maps import last_part as KEY  # noqa: F401
from fluxproof.diagnosis.recording import COLUMNS as CANONICAL

NAME = "common names"
SIGNATURE = set()
COLUMNS = {name: (name, unit) for name, unit in CANONICAL.items()} | {
    "time": ("t", "s"),
    "time_s": ("t", "s"),
    "t_s": ("t", "s"),
    "timestamp": ("t", "s"),
    "ia": ("i_a", "A"),
    "ib": ("i_b", "A"),
    "ic": ("i_c", "A"),
    "id": ("i_d", "A"),
    "iq": ("i_q", "A"),
    "id_ref": ("i_d_ref", "A"),
    "iq_ref": ("i_q_ref", "A"),
    "theta_el": ("theta_e", "rad"),
    "omega_el": ("omega_e", "rad/s"),
    "n_rpm": ("omega_e", "rpm"),
    "speed_rpm": ("omega_e", "rpm"),
    "udc": ("u_dc", "V"),
    "vdc": ("u_dc", "V"),
    "v_dc": ("u_dc", "V"),
    "ud_ref": ("u_d_ref", "V"),
    "uq_ref": ("u_q_ref", "V"),
    "u_d": ("u_d_ref", "V"),
    "u_q": ("u_q_ref", "V"),
    "ud": ("u_d_ref", "V"),
    "uq": ("u_q_ref", "V"),
    "v_d": ("u_d_ref", "V"),
    "v_q": ("u_q_ref", "V"),
    "vd": ("u_d_ref", "V"),
    "vq": ("u_q_ref", "V"),
    "uab": ("u_ab", "V"),
    "ubc": ("u_bc", "V"),
    "uca": ("u_ca", "V"),
    "vab": ("u_ab", "V"),
    "vbc": ("u_bc", "V"),
    "vca": ("u_ca", "V"),
    "duty_a": ("d_a", "1"),
    "duty_b": ("d_b", "1"),
    "duty_c": ("d_c", "1"),
}
