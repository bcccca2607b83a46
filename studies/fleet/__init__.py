# SPDX-License-Identifier: BSD-3-Clause
"""Simulated fleets and the figures of ``fluxproof fleet`` on them (``make fleet``)."""
