# Only for synthesis of the core alone (out of context): in a design the clock comes from outside.
create_clock -name aclk -period 5.000 [get_ports aclk]
