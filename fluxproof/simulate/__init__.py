# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof simulate``: a drive as its drive.toml describes it, in closed loop with the golden core, and a report.

scene      what happens when: start, speed step, load step, reversal
run        the golden core on the switching plant; a trip turns the gates off
margins    phase and gain margin of the loops, delay, sampling and the turning rotor included
regeneration  what braking feeds back, and what the bus needs for it
ripple     the current inside PWM periods
response   a step of a reference on a running drive, predicted
figures    what the runs and the data say, as numbers
verdict    whether the drive is fit to be built, and why not
pictures, page    the report
"""
