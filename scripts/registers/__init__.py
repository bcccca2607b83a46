# SPDX-License-Identifier: BSD-3-Clause
"""The register map as SystemRDL, and everything generated from it: VHDL, C header, names, HTML, IP-XACT."""
