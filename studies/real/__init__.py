"""Diagnosis of recordings of real drives, and of a measured flux map driven in closed loop (``make real``)."""
