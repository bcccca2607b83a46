# SPDX-License-Identifier: BSD-3-Clause
"""Layout of the plant's state vector: one float64 array per drive.

The first block is the true state and the inputs that vary slowly, the second
block is written by the kernels at the end of every period.  The indices are
module constants, so numba folds them into the compiled code.
"""

import numpy as np

# --- state variables -----------------------------------------------------------
LAMBDA_ALPHA = 0  # stator flux linkage, stator frame [Wb]
LAMBDA_BETA = 1
OMEGA_M = 2  # mechanical speed [rad/s]
THETA_M = 3  # mechanical angle, not wrapped [rad]
TIME = 4  # [s]
GATES = 5  # gate word in force at the end of the last period (switching plant)

# --- inputs that vary slowly: the caller may write them between periods -----
TEMP_WINDING = 6  # [deg C]
TEMP_MAGNET = 7  # [deg C]

# --- outputs at the end of the period ---------------------------------------
I_A = 8  # terminal currents [A]
I_B = 9
I_C = 10
I_D = 11  # terminal currents in the rotor frame [A]
I_Q = 12
LAMBDA_D = 13  # flux linkage in the rotor frame [Wb]
LAMBDA_Q = 14
TORQUE = 15  # air-gap torque, cogging included [Nm]
THETA_E = 16  # electrical angle of the d axis, in [0, 2 pi) [rad]

# --- means over the period --------------------------------------------------
U_ALPHA = 17  # voltage at the machine's terminals [V]
U_BETA = 18
I_ALPHA_MEAN = 19  # terminal current [A]
I_BETA_MEAN = 20
P_IN = 21  # power into the terminals [W]
P_COPPER = 22  # winding loss [W]
P_AIRGAP = 23  # air-gap torque times speed [W]

# --- terminal currents and angle at the probe instant (switching plant) -----
PROBE_A = 24  # [A]
PROBE_B = 25
PROBE_C = 26
PROBE_THETA_M = 27  # [rad]

# --- state variable of a shorted winding --------------------------------------
I_SHORT = 28  # current through the short [A]

STATE_SIZE = 29

_NAMES = {
    name.lower(): value
    for name, value in list(globals().items())
    if name.isupper() and name != "STATE_SIZE" and not name.startswith("_")
}


def state_names():
    """Return {name: index}, names in lower case, for recording and plotting."""
    return dict(_NAMES)


def empty_state():
    """Return a zeroed state vector, shape (STATE_SIZE,), float64."""
    return np.zeros(STATE_SIZE)
