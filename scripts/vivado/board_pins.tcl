# SPDX-License-Identifier: BSD-3-Clause
# Says how many pins each line of fluxproof_board.xdc finds in the open design, so that none is lost unseen:
#
#   open_run synth_1
#   source scripts/vivado/board_pins.tcl
#
# A front end that is not built has 0.  An encoder or converter of yours with 0 is unconstrained.

set here [file dirname [file normalize [info script]]]
set handle [open [file join $here fluxproof_board.xdc]]
set text [read $handle]
close $handle

set patterns [list *stage/caught_reg/PRE]
foreach {match pattern} [regexp -all -inline {NAME =~ ([^\}]+)\}} $text] {
  if {[lsearch -exact $patterns $pattern] < 0} {
    lappend patterns $pattern
  }
}
set total 0
foreach pattern $patterns {
  set found [llength [get_pins -quiet -hierarchical -filter "NAME =~ $pattern"]]
  puts "fluxproof_board.xdc: $found pins match $pattern"
  incr total $found
  if {$found == 0 && $pattern eq "*stage/caught_reg/PRE"} {
    error "no pin matches $pattern: the trip pin is unconstrained; is there a fluxproof_board in the open design?"
  }
}
puts "fluxproof_board.xdc: $total pins in all"
