# SPDX-License-Identifier: BSD-3-Clause
"""`make mutate`: faults drawn at random in the netlist of each block; its bench must notice all that can matter."""
