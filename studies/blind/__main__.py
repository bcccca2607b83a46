"""`python -m studies.blind --seed 1 --count 300`: generate, diagnose, score; results in build/blind."""

from __future__ import annotations

import argparse
import sys

from fluxproof.checkout import BUILD
from studies.blind.generate import generate
from studies.blind.score import print_figures, score


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", action="store_true", help="use the existing cases")
    options = parser.parse_args(arguments)
    folder = BUILD / "blind" / f"seed{options.seed}"
    if not options.keep or not (folder / "sealed.sha256").exists():
        print("sealed, SHA-256", generate(options.seed, folder, options.count, jobs=options.jobs))
    print_figures(score(folder, options.jobs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
