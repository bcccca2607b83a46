# SPDX-License-Identifier: BSD-3-Clause
"""The command ``fluxproof``, also as ``python -m fluxproof``."""

import sys

from fluxproof.guard import guarded


def main() -> int:
    """Run the command of this process; the exit status."""
    return guarded(_run, process=True)


def _run() -> int:
    from fluxproof.command import dispatch

    return dispatch(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
