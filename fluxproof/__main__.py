# SPDX-License-Identifier: BSD-3-Clause
"""``python -m fluxproof``: the same as the command ``fluxproof``."""

import sys

from fluxproof.command import main

sys.exit(main())
