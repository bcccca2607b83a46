# SPDX-License-Identifier: BSD-3-Clause
"""The motor in the FPGA: its registers and tables from a machine's data, and its model beside the plant; docs/hil.md."""
