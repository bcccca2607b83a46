# SPDX-License-Identifier: BSD-3-Clause
"""Everything that recording or drive file may mean instead of what they say: the hypotheses, none of them judged here.

reading.py    one reading of recording and drive file: what it changes in a view and in a recording
table.py      all readings, in plain words (interpret/ judges them by the evidence)
apply.py      readings applied to a drive, a recording and a drive file
restated.py   another sample time, other pole pairs: the file is read again (loading/reread.py judges)
exchanges.py  columns in another order or with another sign (checks/phases.py judges)
units.py      units that nothing states (checks/sizes.py and checks/unit_angle.py judge)
"""
