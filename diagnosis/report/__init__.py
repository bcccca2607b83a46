"""What a diagnosis leaves behind: diagnosis.json for machines, report.html for people."""

from fluxproof.diagnosis.report.write import write_outputs

__all__ = ["write_outputs"]
