# The clock, only where the core is synthesised alone: in a design it comes from outside (Vivado gives a packaged core
# its own).
create_clock -name aclk -period 5.000 [get_ports aclk]
