# SPDX-License-Identifier: BSD-3-Clause
# Constraints of the core itself, scoped to fluxproof_axi (IP-XACT does that; by hand: read_xdc -ref fluxproof_axi).

# The trip pin sets this register without a clock, so there is no edge to be in time for.  From its output on, every
# path is timed; the two registers behind it carry ASYNC_REG in the VHDL.
set_false_path -to [get_pins stage/caught_reg/PRE]
# With TRIP_FILTER the pin enters here, a first register with ASYNC_REG; -quiet, because by default there is no filter.
set_false_path -quiet -to [get_pins -quiet -hierarchical -filter {NAME =~ *stage/*/sync_1_reg/D}]
