# SPDX-License-Identifier: BSD-3-Clause
"""What every room of the diagnosis builds on.

recording.py      a recording in canonical form; result.py, a diagnosis
nominal.py        the drive as its file describes it; plant_section.py, the hardware with its [plant.*] sections
constants.py      every number that is a choice and decides what is reported
quantities.py     numbers with units as text
"""
