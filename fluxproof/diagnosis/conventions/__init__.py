"""Mistaken conventions: the recording or the drive file is to be read otherwise than documented.

reading.py  one such reading: what it changes in a view and in a recording
table.py    all readings, in plain words
judge.py    which readings the data prefer, by the evidence that also judges effects
apply.py    readings applied to a drive, a recording and a drive file
tell.py     the answer under the preferred reading
"""
