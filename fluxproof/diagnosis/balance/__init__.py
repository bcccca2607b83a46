# SPDX-License-Identifier: BSD-3-Clause
"""From recordings to rows of a regression: blocks, the misfit of the nominal drive, harmonics.

blocks.py, slow_view.py  steady blocks of fast and of slow recordings, as a view (view.py)
joined.py                several recordings as one view; holdout.py, which blocks are not fitted
misfit.py                recorded minus nominal; described.py, what the drive file has beyond a linear machine
orders.py                rows of the balance as amplitudes of one order
cells.py                 harmonics of the misfit and of every column, with their noise
quantised_angle.py       the noise of an encoder's codes
parts.py                 which of several recordings can be used
"""
