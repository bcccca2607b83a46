# SPDX-License-Identifier: BSD-3-Clause
"""LAAS omodri driver logs (T-Motor MN4004): position, velocity, i_q, u_q at 1 kHz.

Source: the description of the recordings: Position [rad] and Velocity [rad/s] are those of the shaft, Vsupply is scaled
(not in volts and therefore ignored).  The d axis is not logged: i_d is set to its reference, zero.
"""

NAME = "LAAS omodri"
SIGNATURE = {"time", "position", "velocity", "iq", "uq"}
COLUMNS = {
    "time": ("t", "s"),
    "position": ("theta_e", "rad mech"),
    "velocity": ("omega_e", "rad/s mech"),
    "iq": ("i_q", "A"),
    "uq": ("u_q_ref", "V"),
}
ASSUMED = {"i_d": 0.0}
NOTES = [
    "i_d is not in the log and is set to zero; without a d voltage the d axis cannot be diagnosed",
    "the zero of the position is arbitrary: the angle is used for harmonic orders, not for an encoder offset",
]
