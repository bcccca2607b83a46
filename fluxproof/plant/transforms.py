# SPDX-License-Identifier: BSD-3-Clause
"""Clarke's transform, amplitude invariant, alpha on phase a: of numbers in kernels, and of arrays as space vectors.

A space vector is complex, alpha + j beta in the stator frame; times e^(-j theta) it is d + j q (Park).
"""

import math

import numpy as np
from numpy.typing import NDArray

from fluxproof.plant.jit import njit

SQRT3 = math.sqrt(3.0)
AXES: NDArray[np.complex128] = np.exp(
    2j * np.pi / 3 * np.arange(3)
)  # directions of the phases a, b, c in the stator frame
ANGLES = {"a": 0.0, "b": 2.0 * np.pi / 3.0, "c": -2.0 * np.pi / 3.0}  # of these directions [rad]
# Phase values of a unit of alpha or beta over 3/2: patterns of three deviations whose sum is zero.
PATTERNS = {"alpha": (2 / 3, -1 / 3, -1 / 3), "beta": (0.0, 3**-0.5, -(3**-0.5))}


def space_vector(abc: np.ndarray) -> NDArray[np.complex128]:
    """Space vectors (...) of phase values (..., 3); the zero sequence cancels."""
    turned: NDArray[np.complex128] = abc @ AXES
    return (2 / 3) * turned


def phase_values(vector: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase values (..., 3), of zero sum, of space vectors (...)."""
    return (vector[..., None] * np.conj(AXES)).real


def linear_limit(u_dc: float) -> float:
    """Longest voltage vector [V] in any direction that a bus voltage [V] gives without overmodulation."""
    return u_dc / SQRT3


@njit
def clarke(a, b, c):
    """Phase values to (alpha, beta); the zero sequence cancels."""
    return (2.0 * a - b - c) / 3.0, (b - c) / SQRT3


@njit
def inverse_clarke(alpha, beta):
    """(alpha, beta) to phase values of zero sum."""
    half = 0.5 * SQRT3 * beta
    return alpha, half - 0.5 * alpha, -half - 0.5 * alpha


@njit
def phase_matrix(r_a, r_b, r_c):
    """Resistances of the phases [ohm] to the symmetric 2x2 stator-frame matrix.

    Clarke of (r_k i_k) for currents of zero sum.  Equal values return exactly
    (r, 0, r): only the deviations from phase a are transformed.
    """
    d_b, d_c = r_b - r_a, r_c - r_a
    return r_a + (d_b + d_c) / 6.0, (d_c - d_b) / (2.0 * SQRT3), r_a + 0.5 * (d_b + d_c)
