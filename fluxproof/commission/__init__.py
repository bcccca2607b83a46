# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof commission``: what a drive file cannot know is measured over the registers, or refused with a reason.

bus        reading and writing registers by name; a Zynq's userspace I/O
simulated  the same registers in front of the golden core, the switching plant and imperfect sensors
session    registers in force, snapshots in SI units, the watch on the currents, the end with the gates off
wiring     offsets of the current sensors; phases and sensors in order
alignment  direction and offset of the encoder
winding    R, L_d, L_q and the dead-time voltage
motion     inertia and friction, magnet flux, a run that predicts its own voltages
current_scale  the scale of the currents, which only start values or an ammeter can tell
steps      all of them in order
document   drive.toml and commission.json
"""
