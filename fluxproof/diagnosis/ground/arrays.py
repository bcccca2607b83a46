# SPDX-License-Identifier: BSD-3-Clause
"""Types of arrays whose elements matter to the reader: a complex one has two axes, d and q."""

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
