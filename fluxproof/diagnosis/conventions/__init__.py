# SPDX-License-Identifier: BSD-3-Clause
"""Mistaken conventions: ways to read a recording or a drive file otherwise than documented (interpret/ decides).

reading.py  one such reading: what it changes in a view and in a recording
table.py    all readings, in plain words
apply.py    readings applied to a drive, a recording and a drive file
"""
