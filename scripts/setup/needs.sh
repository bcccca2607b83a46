# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts/setup.sh: what each target of the Makefile uses, in words (bash).
#
#   a group of Python packages   each has its list in requirements/ (pyproject.toml says what it is for)
#   ghdl                         a GHDL for simulation, and what links its programs
#   c++                          a C++ compiler, and what Verilator needs beside it
#   tcl, browser                 system packages for some tests
#   ghdl5                        the GHDL that converts the VHDL to Verilog
#   yosys, nextpnr               compiled for this machine where they first run, a minute of work
needs_of() {
    case "$1" in
        demo) echo core run report sim ghdl c++ ghdl5 ;;
        papers | faults) echo core report sim ghdl c++ ghdl5 ;;
        timeline) echo core report sim ghdl ;;
        generate | registers | package) echo core report package ;;
        rough) echo core run ;;
        blind) echo run blind fleet ;;
        fleet) echo run fleet ;;
        sensitivity | mishaps) echo run fleet ;;
        board) echo core run report sim test ghdl c++ ghdl5 ;;
        bench | fuzz) echo run test ;;
        real) echo run fleet test ;;
        compare) echo run compare fleet ;;
        verilog) echo core ghdl5 ;;
        prove) echo core prove ghdl5 yosys ;;
        synth) echo core run report sim synth test ghdl c++ ghdl5 yosys ;;
        ecp5) echo core report synth ghdl5 yosys nextpnr ;;
        lint) echo core run fleet sim lint ;;
        mutate) echo core run report sim package prove test ghdl c++ ghdl5 yosys ;;
        test | slow) echo "$(needs_of mutate)" blind fleet compare lint tcl browser ;;
        setup) echo "$(needs_of test)" synth nextpnr ;;
        *) return 1 ;;
    esac
}
