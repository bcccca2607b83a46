# SPDX-License-Identifier: BSD-3-Clause
# Constraints of a board, scoped to fluxproof_board: read_xdc -ref fluxproof_board scripts/vivado/fluxproof_board.xdc

# The trip pin sets this register without a clock; see fluxproof.xdc.
set_false_path -to [get_pins stage/caught_reg/PRE]

# Pins of encoders, BUSY and the modulators' own clock: no edge to be in time for.  Each passes two registers with
# ASYNC_REG and a filter or a detection of edges; a front end that is not built has no such register, hence -quiet.
set_false_path -quiet -to [get_pins -quiet -hierarchical -filter {NAME =~ position/*/sync_1_reg/D}]
set_false_path -quiet -to [get_pins -quiet -hierarchical -filter {NAME =~ converters/*/busy_meta_reg/D}]
set_false_path -quiet -to [get_pins -quiet -hierarchical -filter {NAME =~ converters/*/clock_meta_reg/D}]

# MISO and the modulators' data are taken at a known clock: their way in is part of the sum in docs/board.md.  5 ns from
# the pad to the register leave the rest of the window to the converter; in the whole design add the pad with
# set_input_delay or set_max_delay from the ports.
set_max_delay -quiet -datapath_only -from [get_ports -quiet {miso[*]}] -to [get_pins -quiet -hierarchical -filter {NAME =~ converters/*/miso_meta_reg[*]/D}] 5.000
set_max_delay -quiet -datapath_only -from [get_ports -quiet {mod_data[*]}] -to [get_pins -quiet -hierarchical -filter {NAME =~ converters/*/data_meta_reg[*]/D}] 5.000
