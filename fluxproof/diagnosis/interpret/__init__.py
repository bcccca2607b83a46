# SPDX-License-Identifier: BSD-3-Clause
"""Did the file mean something else?  judge.py finds what the data prefer."""
