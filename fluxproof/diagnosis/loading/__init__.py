# SPDX-License-Identifier: BSD-3-Clause
"""A file becomes a checked recording.

early.py   what is refused before the libraries of a diagnosis are imported
load.py    reads a file, maps its columns, checks it
reread.py  whether a file that was read again with another sample time or other pole pairs is read rightly
"""
