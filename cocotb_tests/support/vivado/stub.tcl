# SPDX-License-Identifier: BSD-3-Clause
# Runs a script for Vivado without Vivado: every command that it may use is known here with its options; anything
# else, a file that is not there, or a pin that the block design does not have, is an error.
#
#   tclsh stub.tcl FACTS SCRIPT [ARGUMENTS]
#
# FACTS is a Tcl file that sets core_vlnv, core_pins, core_interfaces and core_parameters from component.xml.
# Prints every call, one a line.

clock format 0 -gmt true ;# Tcl loads `clock` at its first use, which needs its own `unknown`

proc unknown {name args} {
  error "unknown command: $name"
}

# command {option arguments ...} least most: how many arguments stand beside the options
array set known {
  create_project        {{-force 0 -in_memory 0 -part 1} 0 2}
  close_project         {{} 0 0}
  current_project       {{} 0 0}
  get_parts             {{} 1 1}
  version               {{-short 0} 0 0}
  current_fileset       {{} 0 0}
  get_filesets          {{} 1 1}
  add_files             {{-norecurse 0 -fileset 1} 1 1}
  get_files             {{} 1 1}
  set_property          {{-dict 1} 1 3}
  get_property          {{} 2 2}
  update_compile_order  {{-fileset 1} 0 0}
  update_ip_catalog     {{} 0 0}
  generate_target       {{} 2 2}
  make_wrapper          {{-files 1 -top 0} 0 0}
  launch_runs           {{-jobs 1 -to_step 1} 1 1}
  wait_on_run           {{} 1 1}
  get_runs              {{} 1 1}
  open_run              {{} 1 1}
  report_utilization    {{-hierarchical 0 -file 1} 0 0}
  report_timing_summary {{-file 1} 0 0}
  report_cdc            {{-file 1} 0 0}
  report_drc            {{-file 1} 0 0}
  create_bd_design      {{} 1 1}
  create_bd_cell        {{-type 1 -vlnv 1 -reference 1} 1 1}
  apply_bd_automation   {{-rule 1 -config 1} 1 1}
  get_bd_pins           {{} 1 1}
  get_bd_intf_pins      {{} 1 1}
  connect_bd_net        {{} 2 99}
  connect_bd_intf_net   {{} 2 2}
  make_bd_pins_external {{-name 1} 1 1}
  assign_bd_address     {{-offset 1 -range 1} 0 1}
  get_bd_addr_segs      {{} 1 1}
  get_bd_cells          {{} 1 1}
  bd::mark_propagate_only {{} 2 2}
  read_vhdl             {{-vhdl2008 0} 1 1}
  read_xdc              {{-ref 1 -mode 1} 1 1}
  synth_design          {{-top 1 -part 1 -mode 1 -generic 1} 0 0}
  opt_design            {{} 0 0}
  place_design          {{} 0 0}
  route_design          {{} 0 0}
  write_checkpoint      {{-force 0} 1 1}
  validate_bd_design    {{} 0 0}
  save_bd_design        {{} 0 0}
  ipx::package_project  {{-root_dir 1 -vendor 1 -library 1 -taxonomy 1 -import_files 0 -set_current 1 -force 0} 0 0}
  ipx::current_core     {{} 0 0}
  ipx::infer_bus_interface {{} 3 3}
  ipx::associate_bus_interfaces {{-busif 1 -clock 1} 1 1}
  ipx::create_xgui_files {{} 1 1}
  ipx::update_checksums {{} 1 1}
  ipx::check_integrity  {{} 1 1}
  ipx::add_file_group   {{-type 1} 2 2}
  ipx::add_file         {{} 2 2}
  ipx::save_core        {{} 1 1}
  ipx::archive_core     {{} 2 2}
  get_ports             {{-filter 1} 0 1}
  get_pins              {{-quiet 0 -hierarchical 0 -filter 1} 0 1}
  all_fanin             {{-flat 0 -startpoints_only 0} 1 1}
  set_max_delay         {{-datapath_only 0 -from 1 -to 1} 1 1}
  get_cells             {{-hierarchical 0 -filter 1} 0 1}
  create_clock          {{-name 1 -period 1} 1 1}
  set_false_path        {{-quiet 0 -from 1 -to 1} 0 0}
  set_input_delay       {{-clock 1} 2 2}
  set_output_delay      {{-clock 1} 2 2}
}
namespace eval ipx {}
namespace eval do_ipx {}
namespace eval bd {}
namespace eval do_bd {}

# Pins and interfaces of the vendor's cores, as far as the example uses them.
array set vendor_pins {
  xilinx.com:ip:processing_system7 {FCLK_CLK0 FCLK_RESET0_N M_AXI_GP0_ACLK S_AXI_HP0_ACLK IRQ_F2P}
  xilinx.com:ip:proc_sys_reset {slowest_sync_clk ext_reset_in peripheral_aresetn interconnect_aresetn}
  xilinx.com:ip:axi_dma {s_axi_lite_aclk m_axi_s2mm_aclk m_axi_sg_aclk axi_resetn s2mm_introut}
  xilinx.com:ip:smartconnect {aclk aresetn}
  xilinx.com:ip:xlconcat {In0 In1 dout}
  xilinx.com:ip:xlconstant {dout}
}
array set vendor_interfaces {
  xilinx.com:ip:processing_system7 {M_AXI_GP0 S_AXI_HP0}
  xilinx.com:ip:proc_sys_reset {}
  xilinx.com:ip:axi_dma {S_AXI_LITE S_AXIS_S2MM M_AXI_S2MM M_AXI_SG}
  xilinx.com:ip:smartconnect {S00_AXI S01_AXI M00_AXI M01_AXI}
  xilinx.com:ip:xlconcat {}
  xilinx.com:ip:xlconstant {}
}
set properties {
  file_type USED_IN top ip_repo_paths name version description display_name
  IOB IOSTANDARD PULLUP PROGRESS STATS.WNS type
}

proc call {name arguments} {
  lassign $::known($name) options least most
  set positional {}
  array set given {}
  while {[llength $arguments]} {
    set arguments [lassign $arguments word]
    if {[string match {-[a-z]*} $word]} {
      if {![dict exists $options $word]} {
        error "$name has no option $word"
      }
      set given($word) 1
      if {[dict get $options $word]} {
        if {![llength $arguments]} {
          error "$name $word: its argument is missing"
        }
        set arguments [lassign $arguments given($word)]
      }
    } else {
      lappend positional $word
    }
  }
  set count [llength $positional]
  if {$count < $least || $count > $most} {
    error "$name takes $least to $most arguments, got $count: $positional"
  }
  puts "$name [array get given] $positional"
  if {[info procs do_$name] ne ""} {
    return [do_$name [array get given] {*}$positional]
  }
  return [expr {$count ? [lindex $positional 0] : $name}]
}

foreach name [array names known] {
  proc $name args "call [list $name] \$args"
}

set files {}
set project_part ""
proc do_create_project {options args} {
  set ::project_part [dict get $options -part]
}
proc do_version {options} {
  return [expr {[dict exists $options -short] ? "2023.2" : "Vivado v2023.2 (64-bit)"}]
}
proc do_add_files {options names} {
  foreach name $names {
    if {![file exists $name] && ![string match made:* $name]} {
      error "add_files: no file $name"
    }
    lappend ::files $name
  }
}
proc do_get_files {options names} {
  foreach name $names {
    if {![llength [lsearch -all -glob $::files "*$name"]]} {
      error "get_files: $name was not added"
    }
  }
  return $names
}
proc do_make_wrapper {options} {
  do_get_files {} [dict get $options -files]
  return made:wrapper
}
proc do_set_property {options args} {
  set pairs [expr {[dict exists $options -dict] ? [dict get $options -dict] : [lrange $args 0 1]}]
  set object [lindex $args end]
  if {$object eq ""} {
    error "set_property [lindex $pairs 0]: no object"
  }
  foreach {property value} $pairs {
    if {$property eq "CONFIG.PCW_FPGA0_PERIPHERAL_FREQMHZ"} {
      set ::fclk_hz [expr {round($value * 1e6) + $::fclk_error}]
    }
    if {[string match CONFIG.* $property]} {
      set own [expr {$object eq [cell_of_core]}]
      if {$own && [string range $property 7 end] ni $::core_parameters} {
        error "the core has no parameter $property"
      }
    } elseif {$property ni $::properties} {
      error "set_property: property $property is not known"
    }
    if {$property eq "ip_repo_paths"} {
      set ::repository $value
    }
  }
}
proc do_get_property {options property object} {
  if {$property eq "CONFIG.FREQ_HZ"} {
    return $::fclk_hz
  }
  if {$property eq "generic" && $object eq "sources_1"} {
    return $::generics_of_project
  }
  if {$property eq "DIRECTORY"} {
    return [pwd]
  }
  set of [dict create get_parts [list SPEED] impl_1 [list PROGRESS STATS.WNS] current_project [list PART]]
  set kind [expr {$object eq $::project_part ? "get_parts" : $object}]
  if {![dict exists $of $kind] || $property ni [dict get $of $kind]} {
    error "get_property: $object has no property $property"
  }
  # A part's name ends with its speed grade.
  set speed [regexp -inline {\-\d\w*$} $::project_part]
  return [dict get [list PROGRESS 100% STATS.WNS 0.5 PART $::project_part SPEED $speed] $property]
}
proc do_read_vhdl {options names} {
  do_add_files {} $names
}
proc do_read_xdc {options name} {
  do_add_files {} [list $name]
  source $name
}
proc do_synth_design {options} {
  if {[dict get $options -top] ne [lindex [split $::core_vlnv :] 2]} {
    take_module [dict get $options -top]
  }
  foreach generic [dict get $options -generic] {
    if {[lindex [split $generic =] 0] ni $::core_parameters} {
      error "synth_design: the top has no generic $generic"
    }
  }
}
proc do_get_bd_addr_segs {options pattern} {
  part_of [join [lrange [split $pattern /] 0 1] /] $::core_interfaces [array get ::vendor_interfaces]
}
proc do_get_bd_cells {options name} {
  if {![info exists ::cells($name)]} {
    error "no cell $name"
  }
  return $name
}
proc do_ipx::add_file {options name group} {
  if {![file exists [file join $::packaged $name]]} {
    error "ipx::add_file: no file $name"
  }
  return $name
}
proc do_ipx::package_project {options} {
  set ::packaged [dict get $options -root_dir]
  set ::packaged_as [dict get $options -vendor]:[dict get $options -library]
}
proc do_ipx::infer_bus_interface {options pin kind core} {
  if {$pin ni $::core_pins} {
    error "ipx::infer_bus_interface: no port $pin"
  }
}
proc do_ipx::associate_bus_interfaces {options core} {
  if {[dict get $options -busif] ni $::core_interfaces || [dict get $options -clock] ni $::core_interfaces} {
    error "ipx::associate_bus_interfaces: no such interface: $options"
  }
}
proc do_get_ports {options args} {
  foreach pattern [concat {*}$args] {
    if {[string map {{[*]} {}} $pattern] ni $::core_pins} {
      error "get_ports: no port $pattern"
    }
  }
  return [expr {[llength $args] ? [lindex $args 0] : "ports"}]
}
# The pins of the open design are in design_pins, if FACTS sets it: names from the top of the design on.
proc do_get_pins {options args} {
  if {![dict exists $options -filter]} {
    return [lindex $args 0]
  }
  if {![regexp {^NAME =~ (\S+)$} [dict get $options -filter] -> pattern]} {
    error "get_pins: unknown filter [dict get $options -filter]"
  }
  set pattern [string map {{[} {\[} {]} {\]}} $pattern]
  return [lsearch -all -inline -glob [expr {[info exists ::design_pins] ? $::design_pins : {}}] $pattern]
}
proc do_all_fanin {options pins} {
  if {![llength $pins]} {
    error "all_fanin: no object"
  }
  return ports
}
proc do_set_false_path {options} {
  if {[dict exists $options -to] && [dict get $options -to] eq "" && ![dict exists $options -quiet]} {
    error "set_false_path: no object for -to"
  }
}
proc do_get_cells {options args} {
  return cells
}
proc do_create_bd_design {options name} {
  lappend ::files made:$name.bd
}

array set cells {}
array set connected {}
proc cell_of_core {} {
  foreach name [array names ::cells] {
    if {$::cells($name) eq $::core_vlnv} {
      return $name
    }
  }
  return ""
}
# What a top that is no packaged core has, from its VHDL: it takes the place of the core.
proc take_module {name} {
  set path [lindex [lsearch -all -inline -glob $::files "*/$name.vhd"] 0]
  if {$path eq ""} {
    error "no file $name.vhd was added"
  }
  set handle [open $path]
  set text [read $handle]
  close $handle
  regexp "entity $name is(.*)end entity $name;" $text -> text
  regexp {generic \((.*)\n  \);\n  port \((.*)} $text -> generics ports
  set ::core_parameters {}
  foreach {- word} [regexp -all -inline -line {^    (\w+) +:} $generics] {
    lappend ::core_parameters $word
  }
  set ::core_pins {}
  set ::core_outputs {}
  foreach {- word mode} [regexp -all -inline -line {^    (\w+) +: (in|out) } $ports] {
    lappend ::core_pins $word
    if {$mode eq "out"} {
      lappend ::core_outputs $word
    }
  }
  set ::core_vlnv "module $name"
}
proc do_create_bd_cell {options name} {
  if {[dict exists $options -reference]} {
    take_module [dict get $options -reference]
    set ::cells($name) $::core_vlnv
    return $name
  }
  set vlnv [dict get $options -vlnv]
  if {![info exists ::vendor_pins($vlnv)] && $vlnv ne $::core_vlnv} {
    error "create_bd_cell: no core $vlnv"
  }
  if {$vlnv eq $::core_vlnv && $::repository ne $::packaged} {
    error "create_bd_cell: ip_repo_paths $::repository does not hold $vlnv"
  }
  set ::cells($name) $vlnv
  return $name
}
proc part_of {path own vendor} {
  lassign [split $path /] cell pin
  if {![info exists ::cells($cell)]} {
    error "no cell $cell: $path"
  }
  set vlnv $::cells($cell)
  if {$pin ni [expr {$vlnv eq $::core_vlnv ? $own : [dict get $vendor $vlnv]}]} {
    error "$vlnv has no pin $pin: $path"
  }
  return $path
}
proc do_get_bd_pins {options path} {
  part_of $path $::core_pins [array get ::vendor_pins]
}
proc do_get_bd_intf_pins {options path} {
  part_of $path $::core_interfaces [array get ::vendor_interfaces]
}
proc do_connect_bd_net {options args} {
  foreach pin $args {
    set ::connected($pin) 1
  }
}
proc do_connect_bd_intf_net {options from to} {
  foreach pin [list $from $to] {
    if {[info exists ::connected($pin)]} {
      error "connect_bd_intf_net: $pin is connected already"
    }
    set ::connected($pin) 1
  }
}
proc do_make_bd_pins_external {options pin} {
  set ::connected($pin) 1
}
proc do_validate_bd_design {options} {
  set cell [cell_of_core]
  set open {}
  if {[string match "module *" $::core_vlnv]} {
    set open $::core_outputs
  } else {
    source [file join $::packaged bd bd.tcl]
    init $cell {}
    propagate $cell {}
  }
  foreach pin [concat $::core_pins $::core_interfaces] {
    if {$pin ni $open && ![regexp {^(s_axi|m_axis)_} $pin] && ![info exists ::connected($cell/$pin)]} {
      error "validate_bd_design: $cell/$pin is not connected"
    }
  }
}

set repository ""
set fclk_hz 0
set fclk_error 0
set generics_of_project ""
source [lindex $argv 0]
set script [lindex $argv 1]
set argv [lrange $argv 2 end]
set argc [llength $argv]
if {[catch {source $script} message]} {
  puts stderr "$script: $message"
  exit 1
}
