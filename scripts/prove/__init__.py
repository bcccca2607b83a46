# SPDX-License-Identifier: BSD-3-Clause
"""`make prove`: properties of the VHDL proved for every input, and for each a planted fault that the proof detects."""
