"""From a file to a checked recording in canonical form (with readers/, column_maps/ and checks/).

load.py      reads a file, maps its columns, checks it
columns.py   which column is which; units.py converts, stated.py adds [constants] of the drive file
demand.py    which columns a balance needs
points.py    tables of operating points; emf.py, machines that are turned without current
restated.py  a drive file whose sample time is off by two, or with wrong pole pairs
"""
