# SPDX-License-Identifier: BSD-3-Clause
"""Kaggle "Inverter Data Set": a two-level IGBT inverter with an induction motor, Paderborn University.

Source: the data set's page and M. Stender, O. Wallscheid, J. Böcker, "Data set description: three-phase IGBT
two-level inverter for electrical drives" (2020): each row contains samples k-3 ... k (i_a_k, u_dc_k-1, d_a_k-2, ...)
and the measured mean phase voltages u_a_k-1; the rows are in arbitrary order, sampled at 10 kHz.  Without a rotor
angle and with an induction motor, the balance of a synchronous machine does not apply: the map names the columns, and
the recording is rejected unless [columns] gives an angle.
"""

NAME = "Paderborn inverter data set"
SIGNATURE = {"i_a_k", "i_b_k", "i_c_k", "d_a_k-2", "u_dc_k"}
COLUMNS = {
    "i_a_k": ("i_a", "A"),
    "i_b_k": ("i_b", "A"),
    "i_c_k": ("i_c", "A"),
    "u_dc_k": ("u_dc", "V"),
    "d_a_k-2": ("d_a", "1"),
    "d_b_k-2": ("d_b", "1"),
    "d_c_k-2": ("d_c", "1"),
}
SAMPLE_TIME_S = 1e-4
NOTES = ["the Paderborn inverter set is of an induction motor, its rows are in no order, and it has no rotor angle"]
