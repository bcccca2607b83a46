# SPDX-License-Identifier: BSD-3-Clause
"""The motor in the FPGA: registers and tables from a machine's data; docs/hil.md."""
