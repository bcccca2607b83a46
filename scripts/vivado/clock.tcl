# SPDX-License-Identifier: BSD-3-Clause
# The clock of a project whose top is the core itself, by its generic CLOCK_HZ: FuseSoC sources this when it makes the
# project.  In a block design the clock comes from outside, and Vivado makes the constraint.
#
# The period is cut to whole picoseconds, Vivado's resolution: rather a little too fast a clock than too slow a one.

set generics [get_property generic [get_filesets sources_1]]
if {![regexp {\mCLOCK_HZ=(\d+)} $generics -> clock_hz]} {
  error "the project's generics have no CLOCK_HZ: $generics"
}
set clock_xdc [file join [get_property DIRECTORY [current_project]] fluxproof_clock.xdc]
set stream [open $clock_xdc.new w]
puts $stream "create_clock -name aclk -period [format %.3f [expr {floor(1e12 / $clock_hz) / 1e3}]] \[get_ports aclk\]"
close $stream
file rename -force $clock_xdc.new $clock_xdc
add_files -fileset constrs_1 -norecurse $clock_xdc
