# SPDX-License-Identifier: BSD-3-Clause
"""A file becomes a checked recording.

early.py     what is refused before the libraries of a diagnosis are imported
load.py      reads a file, maps its columns, checks it
restated.py  a drive file whose sample time is off by two, or with wrong pole pairs: the file is read again
"""
