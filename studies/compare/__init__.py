"""What one would use instead of the diagnosis, on the same sealed cases.

Three methods of today: sparse regression (pySINDy), NARMAX selection (SysIdentPy) and a joint least-squares
fit of all parameters of a drive model.  Each gets what the diagnosis itself starts from (data.py): checked
rows in steady blocks, smoothed currents, the exact sampled flux balance.  So what is compared is the naming,
not the reading of files or the differentiation of noise.
"""
