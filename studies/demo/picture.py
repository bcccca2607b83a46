# SPDX-License-Identifier: BSD-3-Clause
"""The README's picture of a diagnosis, of the example: `python -m studies.demo.picture docs/img/diagnosis.png`."""

from __future__ import annotations

import argparse
from pathlib import Path

from fluxproof.checkout import BUILD
from fluxproof.diagnosis.example.recording import write
from fluxproof.diagnosis.session import run
from studies.demo import concealed, plots


def main() -> None:
    """Diagnose the example of `fluxproof diagnose --example` and draw what its page shows."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("picture", type=Path, metavar="FILE.png")
    options = parser.parse_args()
    out = BUILD / "demo" / "picture"
    example = write(out)
    answer = run([example.recording], example.drive, out)
    shown = concealed.view(*example, answer)
    plots.write_png(plots.styled(concealed.overview, shown, answer.to_json()), options.picture)


if __name__ == "__main__":
    main()
