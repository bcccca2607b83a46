"""Why a real drive differs from its simulation: recordings in, explanation out."""

__all__ = ["diagnose"]


def __getattr__(name):
    if name == "diagnose":
        from fluxproof.diagnosis.session import diagnose

        return diagnose
    raise AttributeError(name)
