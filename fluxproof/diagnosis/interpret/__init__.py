# SPDX-License-Identifier: BSD-3-Clause
"""Did the file mean something else?  judge.py finds the reading that the data prefer, tell.py answers under it."""
