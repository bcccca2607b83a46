# SPDX-License-Identifier: BSD-3-Clause
"""Packaging: the AXI top, IP-XACT, FuseSoC; all generated from the entities and the register map."""
