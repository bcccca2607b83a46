"""Fluxproof in Python: the golden model of the core, the plant, and the diagnosis of recordings.

from fluxproof import diagnose
answer = diagnose("recording.csv", "drive.toml")
print(answer.verdict, answer.sentence)
"""

from pathlib import Path

__all__ = ["diagnose"]

# In a checkout golden_model, plant, cosim and diagnosis are next to this folder; in a wheel they are inside it.
_ROOT = Path(__file__).resolve().parent.parent
if (_ROOT / "pyproject.toml").is_file() and (_ROOT / "golden_model").is_dir():
    __path__.append(str(_ROOT))


def __getattr__(name: str):
    """Import ``diagnose`` on first use: it takes a second, which ``fluxproof --help`` should not wait."""
    if name == "diagnose":
        from fluxproof.diagnosis.session import diagnose

        return diagnose
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
