# SPDX-License-Identifier: BSD-3-Clause
# Packages the core as Vivado would by hand, into OUT_DIR/ip (default build/vivado/ip):
#
#   vivado -mode batch -source scripts/vivado/package_ip.tcl [-tclargs OUT_DIR]
#
# The repository's root is an IP repository too: its component.xml describes the same core without this script.

set root [file normalize [file join [file dirname [info script]] .. ..]]
set out [file join $root build vivado]
if {$argc > 0} {
  set out [file normalize [lindex $argv 0]]
}
set ip [file join $out ip]

# Name, version and description stand in component.xml already, two columns in.
set stream [open [file join $root component.xml]]
set component [read $stream]
close $stream
proc described {name} {
  if {![regexp -line "^  <spirit:$name>(.*)</spirit:$name>$" $::component -> value]} {
    error "component.xml: no line <spirit:$name>"
  }
  return $value
}

# Vivado finds the compile order itself.
set sources [concat [glob [file join $root rtl *.vhd]] [glob [file join $root rtl * *.vhd]]]
set top [file join $root rtl generated fluxproof_axi.vhd]
set constraints [file join $root scripts vivado fluxproof.xdc]

create_project -force -part xc7z020clg484-1 package [file join $out package]
add_files -norecurse $sources
set_property file_type {VHDL 2008} [get_files $sources]
set_property file_type VHDL [get_files $top]
add_files -fileset constrs_1 -norecurse $constraints
set_property USED_IN implementation [get_files $constraints] ;# it names registers, which synthesis has yet to make
set_property top fluxproof_axi [get_filesets sources_1]
update_compile_order -fileset sources_1

ipx::package_project -root_dir $ip -vendor [described vendor] -library [described library] \
  -taxonomy /UserIP -import_files -set_current true -force
set core [ipx::current_core]
foreach property {name version description} {
  set_property $property [described $property] $core
}
set_property display_name {Fluxproof PMSM drive} $core
# s_axi, m_axis, aclk and aresetn are recognised by their names; the interrupt is not.
ipx::infer_bus_interface irq xilinx.com:signal:interrupt_rtl:1.0 $core
foreach interface {s_axi m_axis} {
  ipx::associate_bus_interfaces -busif $interface -clock aclk $core
}
# CLOCK_HZ follows the clock.
file mkdir [file join $ip bd]
file copy -force [file join $root bd bd.tcl] [file join $ip bd bd.tcl]
set diagram [ipx::add_file_group -type xilinx_blockdiagram {} $core]
set_property type tclSource [ipx::add_file bd/bd.tcl $diagram]
ipx::create_xgui_files $core
ipx::update_checksums $core
ipx::check_integrity $core
ipx::save_core $core
ipx::archive_core [file join $out fluxproof_axi.zip] $core
close_project
puts "packaged: $ip"
