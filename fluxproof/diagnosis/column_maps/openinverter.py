# SPDX-License-Identifier: BSD-3-Clause
"""Values that an openinverter (stm32-sine, FOC firmware) sends or that its web interface logs.

Source: include/param_prj.h of jsphuebner/stm32-sine (names and units of the displayed values) and foc.cpp of its
library: the Clarke transformation is amplitude-invariant; ud and uq are in digits of a PWM of 16 bits, so that 65,536
are the bus voltage and 37,837 the largest modulation, u_dc / sqrt(3).  ``fstat`` is the electrical frequency without a
sign in some versions; opmode is 0 while the gates are off.
"""

NAME = "openinverter"
SIGNATURE = {"id", "iq", "ud", "uq", "fstat", "udc"}
COLUMNS = {
    "time": ("t", "s"),
    "timestamp": ("t", "s"),
    "id": ("i_d", "A"),
    "iq": ("i_q", "A"),
    "ud": ("u_d_ref", "u_dc/65536"),
    "uq": ("u_q_ref", "u_dc/65536"),
    "fstat": ("omega_e", "Hz"),
    "udc": ("u_dc", "V"),
    "tmpm": ("temp_winding", "degC"),
    "opmode": ("enable", "1"),
}
NOTES = ("fstat of an openinverter has no sign in some versions of the firmware: leave out the rows in reverse",)
