# SPDX-License-Identifier: BSD-3-Clause
"""A drive simulation of its own at switching level, for the benchmark: it shares no code with the catalogue or plant.

drives.py     random machines and inverters in per-unit, and their drive files
params.py     the numbers that the compiled simulation takes
magnetics.py  flux linkages and their inverse, torque from the co-energy
inverter.py   legs between switching instants: dead time, commutation, bus
machine.py    one substep: flux linkages, loss branches, shaft
sensors.py    converters, encoder, resolver, bus sensor
control.py    current and speed regulators, modulation
loop.py       the control periods one after the other
plan.py       what the drive is asked to do
faults.py     what the real drive does differently
cases.py      strata and random draws
record.py     one recording from a case; write.py: its files and its entry of the truth
"""
