# SPDX-License-Identifier: BSD-3-Clause
"""`make hil`: the motor in the FPGA against the plant, its RTL against its model, its pace; docs/hil.md."""
