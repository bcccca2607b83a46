# SPDX-License-Identifier: BSD-3-Clause
"""The output files of a diagnosis: diagnosis.json for programs, report.html for people."""

from fluxproof.diagnosis.report.write import write_outputs

__all__ = ["write_outputs"]
