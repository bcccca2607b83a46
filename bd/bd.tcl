# SPDX-License-Identifier: BSD-3-Clause
# Run by Vivado's block design for each fluxproof_axi in it: CLOCK_HZ is the rate of the clock that is connected, so
# that software, which reads it back, cannot be told another one.

proc init {cell_name args} {
  bd::mark_propagate_only [get_bd_cells $cell_name] "CLOCK_HZ"
}

proc propagate {cell_name args} {
  set rate [get_property CONFIG.FREQ_HZ [get_bd_pins $cell_name/aclk]]
  if {$rate ne ""} {
    set_property CONFIG.CLOCK_HZ [expr {round($rate)}] [get_bd_cells $cell_name]
  }
}
