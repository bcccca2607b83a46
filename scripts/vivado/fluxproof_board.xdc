# SPDX-License-Identifier: BSD-3-Clause
# Constraints of a board, scoped to fluxproof_board: read_xdc -ref fluxproof_board scripts/vivado/fluxproof_board.xdc
# NAME is the name from the top of the whole design on, hence the leading *.  A front end that is not built has no such
# register: Vivado warns that nothing was found, and scripts/vivado/board_pins.tcl counts what each line finds.

# The trip pin sets this register without a clock, or enters the filter of TRIP_FILTER; see fluxproof.xdc.
set_false_path -to [get_pins stage/caught_reg/PRE]
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *stage/*/sync_1_reg/D}]

# Pins of encoders, BUSY and the modulators' own clock: no edge to be in time for.  Each passes two registers with
# ASYNC_REG and a filter or a detection of edges.
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *position/*/sync_1_reg/D}]
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *master_pins/*/sync_1_reg/D}]
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *converters/*/busy_meta_reg/D}]
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *converters/*/clock_meta_reg/D}]

# MISO and the modulators' data are taken at a known clock: their way in is part of the sum in docs/board.md.  5 ns from
# where they enter to the register leave the rest of the window to the converter; in the whole design add the pad with
# set_input_delay or set_max_delay from the ports.  Where they enter is asked of the register, since the ports of this
# entity are no ports of the design in a block design.
set_max_delay -datapath_only -from [all_fanin -flat -startpoints_only [get_pins -hierarchical -filter {NAME =~ *converters/*/miso_meta_reg[*]/D}]] -to [get_pins -hierarchical -filter {NAME =~ *converters/*/miso_meta_reg[*]/D}] 5.000
set_max_delay -datapath_only -from [all_fanin -flat -startpoints_only [get_pins -hierarchical -filter {NAME =~ *converters/*/data_meta_reg[*]/D}]] -to [get_pins -hierarchical -filter {NAME =~ *converters/*/data_meta_reg[*]/D}] 5.000
