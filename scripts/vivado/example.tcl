# SPDX-License-Identifier: BSD-3-Clause
# A small Zynq-7000 project with the core in a block design, synthesised, placed and routed, with reports:
#
#   vivado -mode batch -source scripts/vivado/example.tcl [-tclargs OUT_DIR PART]
#
# The processor loads the registers over AXI (GP0), a DMA writes the telemetry into its memory (HP0), a remembered
# trip interrupts it.  Converters, encoder, trip and gates go to pins; give them numbers in example.xdc before you
# write a bitstream.  Reports: OUT_DIR/reports; OUT_DIR/result.md is a row for the table of docs/vivado.md.
# `fluxproof project drive.toml` writes a script that sets the drive's own values below and sources this one.
# With hil = 1 the motor is in the FPGA (fluxproof_hil) and no pin of the drive leaves the chip.

set here [file dirname [file normalize [info script]]]
set root [file normalize [file join $here .. ..]]
set out [file join $root build vivado]
set part xc7z020clg484-1
if {$argc > 0} {
  set out [file normalize [lindex $argv 0]]
}
if {$argc > 1} {
  set part [lindex $argv 1]
}
set argc 1
set argv [list $out]
source [file join $here package_ip.tcl]
source [file join $here result.tcl]

# Without a drive: 100 MHz and 10 kHz PWM.
foreach {name value} {
  clock_hz 100000000 adc_bits 16 position_bits 16 carrier_half 5000 estimators 1 base_address 0x43C00000
  gate_active 1 trip_active 1 brake_active 1 hil 0 encoder 0
} {
  if {![info exists $name]} {
    set $name $value
  }
}
set clock_mhz [format %g [expr {$clock_hz / 1e6}]]

create_project -force -part $part example [file join $out example]
set_property ip_repo_paths [file join $out ip] [current_project]
update_ip_catalog
create_bd_design example

# Processor: one clock for everything, GP0 for registers, HP0 for the telemetry, one interrupt line.
set ps [create_bd_cell -type ip -vlnv xilinx.com:ip:processing_system7 ps]
apply_bd_automation -rule xilinx.com:bd_rule:processing_system7 \
  -config {make_external "FIXED_IO, DDR" Master Disable Slave Disable} $ps
set_property -dict [list \
  CONFIG.PCW_FPGA0_PERIPHERAL_FREQMHZ $clock_mhz \
  CONFIG.PCW_USE_M_AXI_GP0 1 \
  CONFIG.PCW_USE_S_AXI_HP0 1 \
  CONFIG.PCW_USE_FABRIC_INTERRUPT 1 \
  CONFIG.PCW_IRQ_F2P_INTR 1] $ps
set reset [create_bd_cell -type ip -vlnv xilinx.com:ip:proc_sys_reset reset]

if {$hil} {
  add_files [concat [glob [file join $root rtl *.vhd]] [glob [file join $root rtl * *.vhd]]]
  set_property file_type {VHDL 2008} [get_files *.vhd]
  # A block design takes only a module of VHDL-93; what that instantiates may be newer.
  set_property file_type VHDL [get_files fluxproof_hil.vhd]
  set drive [create_bd_cell -type module -reference fluxproof_hil drive]
  set_property -dict [list CONFIG.CLOCK_HZ $clock_hz CONFIG.ENCODER $encoder] $drive
} else {
  set drive [create_bd_cell -type ip -vlnv fluxproof:motor_control:fluxproof_axi drive]
}
set_property -dict [list \
  CONFIG.ADC_BITS $adc_bits \
  CONFIG.POSITION_BITS $position_bits \
  CONFIG.CARRIER_HALF $carrier_half \
  CONFIG.ESTIMATORS $estimators \
  CONFIG.GATE_ACTIVE $gate_active \
  CONFIG.TRIP_ACTIVE $trip_active \
  CONFIG.BRAKE_ACTIVE $brake_active] $drive

# Telemetry: packets of the stream into memory, one descriptor each, as docs/telemetry.md tells.
set dma [create_bd_cell -type ip -vlnv xilinx.com:ip:axi_dma dma]
set_property -dict [list \
  CONFIG.c_include_sg 1 \
  CONFIG.c_sg_include_stscntrl_strm 0 \
  CONFIG.c_include_mm2s 0 \
  CONFIG.c_include_s2mm 1 \
  CONFIG.c_s_axis_s2mm_tdata_width 32 \
  CONFIG.c_sg_length_width 23] $dma

set control [create_bd_cell -type ip -vlnv xilinx.com:ip:smartconnect control]
set_property -dict [list CONFIG.NUM_SI 1 CONFIG.NUM_MI 2] $control
set memory [create_bd_cell -type ip -vlnv xilinx.com:ip:smartconnect memory]
set_property -dict [list CONFIG.NUM_SI 2 CONFIG.NUM_MI 1] $memory
set interrupts [create_bd_cell -type ip -vlnv xilinx.com:ip:xlconcat interrupts]
set_property CONFIG.NUM_PORTS 2 $interrupts

connect_bd_intf_net [get_bd_intf_pins ps/M_AXI_GP0] [get_bd_intf_pins control/S00_AXI]
connect_bd_intf_net [get_bd_intf_pins control/M00_AXI] [get_bd_intf_pins drive/s_axi]
connect_bd_intf_net [get_bd_intf_pins control/M01_AXI] [get_bd_intf_pins dma/S_AXI_LITE]
connect_bd_intf_net [get_bd_intf_pins drive/m_axis] [get_bd_intf_pins dma/S_AXIS_S2MM]
connect_bd_intf_net [get_bd_intf_pins dma/M_AXI_S2MM] [get_bd_intf_pins memory/S00_AXI]
connect_bd_intf_net [get_bd_intf_pins dma/M_AXI_SG] [get_bd_intf_pins memory/S01_AXI]
connect_bd_intf_net [get_bd_intf_pins memory/M00_AXI] [get_bd_intf_pins ps/S_AXI_HP0]

set clock [get_bd_pins ps/FCLK_CLK0]
foreach pin {
  ps/M_AXI_GP0_ACLK ps/S_AXI_HP0_ACLK reset/slowest_sync_clk control/aclk memory/aclk drive/aclk
  dma/s_axi_lite_aclk dma/m_axi_s2mm_aclk dma/m_axi_sg_aclk
} {
  connect_bd_net $clock [get_bd_pins $pin]
}
connect_bd_net [get_bd_pins ps/FCLK_RESET0_N] [get_bd_pins reset/ext_reset_in]
foreach pin {control/aresetn memory/aresetn drive/aresetn dma/axi_resetn} {
  connect_bd_net [get_bd_pins reset/peripheral_aresetn] [get_bd_pins $pin]
}
connect_bd_net [get_bd_pins drive/irq] [get_bd_pins interrupts/In0]
connect_bd_net [get_bd_pins dma/s2mm_introut] [get_bd_pins interrupts/In1]
connect_bd_net [get_bd_pins interrupts/dout] [get_bd_pins ps/IRQ_F2P]

if {$hil} {
  set no_trip [create_bd_cell -type ip -vlnv xilinx.com:ip:xlconstant no_trip]
  set_property CONFIG.CONST_VAL [expr {1 - $trip_active}] $no_trip
  connect_bd_net [get_bd_pins no_trip/dout] [get_bd_pins drive/trip]
} else {
  foreach pin {
    sample_trigger sample_valid adc_a adc_b adc_c adc_u_dc position_code trip gate_high gate_low brake
  } {
    make_bd_pins_external -name $pin [get_bd_pins drive/$pin]
  }
}

assign_bd_address -offset $base_address -range 4K [get_bd_addr_segs drive/s_axi/*]
assign_bd_address
validate_bd_design
# The processor's clock has steps: PWM period and dead time are right only if it is the one asked for.
set rate [get_property CONFIG.FREQ_HZ [get_bd_pins ps/FCLK_CLK0]]
if {abs($rate / double($clock_hz) - 1) > 1e-4} {
  error "the processor makes $rate Hz out of clock_hz = $clock_hz: put $rate into the drive file, or choose another"
}
save_bd_design

set design [get_files example.bd]
generate_target all $design
add_files -norecurse [make_wrapper -files $design -top]
if {!$hil} {
  add_files -fileset constrs_1 -norecurse [file join $here example.xdc]
  set_property USED_IN implementation [get_files example.xdc]
}
set_property top example_wrapper [get_filesets sources_1]
update_compile_order -fileset sources_1

launch_runs impl_1 -jobs 4
wait_on_run impl_1
if {[get_property PROGRESS [get_runs impl_1]] ne "100%"} {
  error "implementation failed: see [file join $out example example.runs impl_1 runme.log]"
}
open_run impl_1
set reports [file join $out reports]
file mkdir $reports
report_utilization -hierarchical -file [file join $reports utilization.rpt]
report_timing_summary -file [file join $reports timing.rpt]
report_cdc -file [file join $reports cdc.rpt]
report_drc -file [file join $reports drc.rpt]
set slack [write_result $out $root impl_1 $clock_mhz]
puts "worst slack at $clock_mhz MHz: $slack ns; reports: $reports; row for docs/vivado.md: [file join $out result.md]"
