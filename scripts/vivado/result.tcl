# SPDX-License-Identifier: BSD-3-Clause
# What a routed run gave, for the table of docs/vivado.md: OUT_DIR/result.md holds its row, OUT_DIR/result.json the same.

# The commit of the sources: "+" behind it where files have been changed since, "unknown" without git.
proc commit_of {root} {
  if {[catch {exec git -C $root rev-parse --short HEAD} commit]} {
    return unknown
  }
  if {[catch {exec git -C $root status --porcelain --untracked-files=no} changed] || $changed ne ""} {
    append commit +
  }
  return $commit
}

# Written under another name first: a file that is there is complete.
proc write_whole {path text} {
  set stream [open $path.new w]
  puts $stream $text
  close $stream
  file rename -force $path.new $path
}

proc write_result {out root run clock_mhz} {
  set wns [get_property STATS.WNS [get_runs $run]]
  if {![string is double -strict $wns]} {
    error "$run has no worst slack: it is not routed, or nothing in it is timed"
  }
  set part [get_property PART [current_project]]
  set values [list \
    date [clock format [clock seconds] -format %Y-%m-%d -gmt true] \
    part $part \
    speed_grade [get_property SPEED [get_parts $part]] \
    clock_mhz $clock_mhz \
    wns_ns $wns \
    commit [commit_of $root] \
    tool "Vivado [version -short]"]
  set cells {}
  set members {}
  foreach {name value} $values {
    lappend cells $value
    set number [expr {$name in {clock_mhz wns_ns}}]
    lappend members "\"$name\": [expr {$number ? $value : "\"$value\""}]"
  }
  write_whole [file join $out result.md] "| [join $cells { | }] |"
  write_whole [file join $out result.json] "{[join $members {, }]}"
  return $wns
}
