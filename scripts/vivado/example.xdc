# SPDX-License-Identifier: BSD-3-Clause
# Constraints of the example design.  Pin numbers are your board's: add them here before you write a bitstream.
# Until the FPGA is configured its pins are not driven: pull the gates down on the board.

# The gates leave from the registers in the IO cells: all six at the same time, whatever the routing.
set_property IOB TRUE [get_cells -hierarchical -filter {NAME =~ */stage/gate_high_reg*}]
set_property IOB TRUE [get_cells -hierarchical -filter {NAME =~ */stage/gate_low_reg*}]
set_property IOSTANDARD LVCMOS33 [get_ports -filter {NAME !~ DDR* && NAME !~ FIXED_IO*}]
# A trip line that is broken or not connected trips.
set_property PULLUP TRUE [get_ports trip]

# trip is asynchronous (see fluxproof.xdc); nothing clocked outside waits for the gates.
set_false_path -from [get_ports trip]
set_false_path -to [get_ports {gate_high[*] gate_low[*]}]

# Converters and encoder: here their codes come from a chip that is clocked with aclk and settles within 4 ns.
set_input_delay -clock clk_fpga_0 4.000 \
  [get_ports {sample_valid adc_a[*] adc_b[*] adc_c[*] adc_u_dc[*] position_code[*]}]
set_output_delay -clock clk_fpga_0 2.000 [get_ports sample_trigger]
