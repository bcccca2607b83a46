# SPDX-License-Identifier: BSD-3-Clause
"""The example of ``fluxproof diagnose --example``: the core drives a motor that differs from its drive file.

drive.toml    what the drive file says
motor.py      the motor, its inverter and sensors as they are, and the operating points
recording.py  the run with the golden core, written as the core's telemetry
truth.py      what was found beside what was hidden
"""
