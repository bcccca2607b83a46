# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of simulators that other people wrote, for the benchmark: they share no code with the catalogue.

drives.py    machines with published parameters, and how the drive file believes them
faults.py    what the real drive does differently, and what its sensors do
plant.py     the interface of a plant, and its integration over a control period
motulator.py machines, shafts and controllers of motulator, at switching level or averaged
gem.py       machines, inverters and loads of gym-electric-motor, with a controller of its own
sensors.py   converters, encoder and the speed that a drive derives from them
rows.py      one case: plan, closed loop, columns of the recording
cases.py     strata and random draws
"""
