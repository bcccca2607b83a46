# SPDX-License-Identifier: BSD-3-Clause
"""Causes that the simulation has no parameter for: they compete with the catalogue, are described and never named.

Every module in this folder that defines EFFECT is an entry; its ``clause`` completes "as if ...".
Without them their misfit would be shared out among effects of the catalogue that together look alike.
"""

from fluxproof.diagnosis.catalogue import found_in

SUSPECTS = found_in(__name__, __path__)
