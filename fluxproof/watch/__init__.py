# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof watch``: the drive on a page while it runs, replayed bit for bit, and why it differs.

source.py  bytes of a growing file or of a server;  packets.py  whole packets of them;  live.py  the last rows, in
bounded memory;  replay.py  the golden model beside them;  explain.py  the diagnosis of the last seconds;  sinks.py  CSV
and PlotJuggler;  page.py  the page.  Data flows in this order; the page only reads.
"""
