# SPDX-License-Identifier: BSD-3-Clause
"""What several tests share, in rooms by what it is; no test imports another test.

drives.py       drive files, and the numbers of the machine of most tests
needs.py        what a test needs beyond Python, slow.py: cases for `make slow`, browser.py: a page in Chromium
recordings/     recordings of a drive: from the core, from equations, with an effect, with a mistake; dumps, slow logs
diagnoses/      made-up diagnoses, the schema of diagnosis.json, answers to the recordings of a bench
untrusted/      damaged and hostile files, foreign text, what watches that nothing runs
fleet/          a small fleet, rows of its table, work for its processes
peripherals/    encoders and converters as their data sheets describe them (model), runs (bench), inputs (stimulus)
board/          fluxproof_board with what is wired to its pins: model, bench, cases
host/           software on a processor that reaches the registers, of golden model or RTL
in_simulator/   what cocotb runs inside GHDL (dut_*), and what these modules use
core/           the core in closed loop, converted to Verilog, at its limits
vivado/         Tcl for Vivado under a stub
processes/      commands started as a user starts them, and stopped at a chosen moment
"""
