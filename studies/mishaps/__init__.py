# SPDX-License-Identifier: BSD-3-Clause
"""Everyday mishaps of recordings and drive files, each on three simulated drives (``python -m studies.mishaps``)."""
