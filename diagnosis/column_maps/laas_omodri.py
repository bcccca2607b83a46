"""LAAS omodri driver logs (T-Motor MN4004): position, velocity, i_q, u_q at 1 kHz.

Source: the recordings' own description: Position [rad] and Velocity [rad/s] are the shaft's, Vsupply is scaled (not
volts, so it is left out).  The d axis is not logged: i_d is taken as its reference, zero.
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
    "i_d is not in the log and taken as zero; there is no d voltage, so nothing can be said of the d axis",
    "the position's zero is not the magnet's: its angle serves for harmonic orders, not for an encoder offset",
]
