# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a board, from pins to a turning motor: `make board`."""
