# SPDX-License-Identifier: BSD-3-Clause
"""A drive whose machine is a magnetic equivalent circuit, for the benchmark: it shares no code with the tool or plant.

params.py   the numbers that the compiled simulation takes
iron.py     the circuit: teeth, yoke, rotor iron, gap, magnets; currents and torque from one field energy
machine.py  derivatives of flux, shaft, bus and a shorted turn
inverter.py legs with dead time, current-dependent switching times and on-state drops; battery or rectifier
control.py  current regulator of 16-bit integers
sensors.py  converters, encoder, messages of slower loops
loop.py     the control periods one after the other, and the temperatures
drives.py   random machines and supplies, and the drive file
plan.py     what the bench asks for
faults.py   what the real drive does differently
cases.py    strata and random draws
record.py   one recording of a case; write.py: its files and its entry of the truth
"""
