# SPDX-License-Identifier: BSD-3-Clause
"""Formats and constants that several blocks share.  Everything is per unit of the bases in drive.py.

``PU`` has 18 bits, the narrow port of every FPGA multiplier of the last twenty years, and a range
of two: the base is the measuring range of the sensor, and sums of two such quantities still fit.
"""

from golden_model.fixed import Format

BIT = Format(0, 1, 0)
PU = Format(1, 1, 16)  # currents, voltages, speeds, flux linkages
TRIG = Format(1, 1, 16)  # sine and cosine, -1 to +1 both included
TURN = Format(0, 0, 18)  # angles in turns; wraps
CODE = Format(0, 1, 15)  # an ADC code moved to the left edge of 16 bits; half scale is 1.0
DUTY = Format(0, 1, 16)  # 0 to 65536, both included
U_DC = Format(0, 1, 16)  # bus voltage
U_MAX = Format(0, 0, 16)  # radius of the voltage circle
GAIN = Format(1, 1, 16)  # sensor gain, negative for a reversed sensor
KP = Format(0, 8, 16)  # proportional gain, per unit
KI = Format(0, 0, 24)  # integral gain times the sample time, per unit
INDUCTANCE = Format(0, 4, 20)  # inductance, per unit
INTEGRAL = Format(1, 1, 28)  # integrators: 12 bits below PU, so that small errors still move them
RECIPROCAL = Format(0, 0, 17)  # m of 1/x = m * 2**n * 2**-17
FLUX = Format(1, 1, 23)  # fluxes and voltages inside the estimators: 25 bits, the multiplier's wide port
FLUX_STATE = Format(1, 1, 30)  # flux that is integrated: 7 bits below FLUX, see docs/flux_estimator.md
RESISTANCE = Format(0, 0, 24)  # winding resistance, per unit
RHO = Format(0, -2, 24)  # resistive flux drop of half a sample, per unit of current: below 1/4
MINUS_RHO = Format(1, -2, 24)  # minus the resistive flux drop of half a sample: -1/4 to 0, both included
V_LEG = Format(1, -1, 18)  # leg voltage loss by dead time and device drops, below half a voltage base
LIMIT = Format(0, 1, 8)  # trip levels: currents and bus voltage in steps of a 256th of their base
SAMPLE_TIME = Format(0, -1, 18)  # sample time times omega_base: below half a radian a sample at base speed
MOTOR_VOLTAGE = Format(1, 1, 22)  # voltages of the motor in the FPGA, per unit of its own base: docs/hil.md
MOTOR_LEG = Format(1, 6, 22)  # a leg's voltage, summed over the clocks of a step
MOTOR_CHARGE = Format(1, 8, 16)  # currents of the legs, summed over the clocks of a step
MOTOR_FLUX = Format(1, 1, 38)  # flux that is integrated: its LSB is that of a leg's voltage times a clock
MOTOR_TRIG = Format(1, 0, 17)  # sine and cosine of the motor, below 1
MOTOR_ANGLE = Format(0, 0, 25)  # angles of the motor in turns
MOTOR_SPEED = Format(1, -13, 37)  # speed of the motor in turns a step
MOTOR_WAVE = Format(1, -2, 19)  # harmonic fluxes and cogging torque: below a quarter of their base

PU_W, TURN_W, INTEGRAL_W, V_LEG_W = PU.width, TURN.width, INTEGRAL.width, V_LEG.width
DUTY_ONE = 1 << DUTY.frac_bits
TRIG_ONE = 1 << TRIG.frac_bits
VECTOR = 11 << (PU.frac_bits - 3)  # 1.375: a vector with both components below it is shorter than 2 at every angle
FLUX_W, FLUX_STATE_W = FLUX.width, FLUX_STATE.width
PU_TO_INTEGRAL = INTEGRAL.frac_bits - PU.frac_bits
PU_TO_FLUX = FLUX.frac_bits - PU.frac_bits
FLUX_TO_STATE = FLUX_STATE.frac_bits - FLUX.frac_bits
