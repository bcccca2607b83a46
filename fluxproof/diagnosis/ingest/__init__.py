# SPDX-License-Identifier: BSD-3-Clause
"""From the columns of a file to those of a recording (loading/ applies this, then checks/).

columns.py   which column is which; units.py converts, stated.py adds [constants] of the drive file
demand.py    which columns a balance needs
points.py    tables of operating points; emf.py, machines that are turned without current
"""
