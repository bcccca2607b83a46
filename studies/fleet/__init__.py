"""Simulated fleets and the figures of ``fluxproof fleet`` on them (``make fleet``)."""
