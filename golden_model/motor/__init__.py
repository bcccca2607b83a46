# SPDX-License-Identifier: BSD-3-Clause
"""The motor that runs beside the core: inverter, fluxes, currents, shaft, sensors; docs/hil.md."""
