# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof constants``: the numbers of a motor's data sheet as [machine], checked against each other.

meanings   what a number may mean: its factor to psi, for every usual convention
decide     which meanings agree with one another; contradictions by name
command    the subcommand
"""
