# SPDX-License-Identifier: BSD-3-Clause
"""The generative model of the misfit: rows, the columns of a set of effects, and what is found of both.

    y = X c + d + q + e
    e ~ N(0, s^2),   d ~ N(0, (lambda_g l)^2),   q ~ N(0, (mu_g w)^2),   c_k ~ N(0, (a_e p_k b_e)^2)

a_e is the size of effect e in units of its floor of practical interest, with a log-uniform prior from 1 to the size at
which a drive no longer runs; p_k is the coefficient that makes column k as large as the floor (of a curve: the share of
it by which the curve may depart from the formula at most).  b_e is 1 for a column of the formula; for a column of the
effect's free curve it has a log-uniform prior from ``straight`` to 1: a curve that is not needed is no reason against
its effect.  lambda_g is the discrepancy of group g, with the prior (1 + (lambda / k)^2)^-n, and at least 1 where the
error of the balance is known.  w is the error that the curve of an effect may have at most, and mu_g <= 1 the share of
it that is seen in group g: with all of it, a set would gain by a smaller effect with a smaller w.  All are found by
expectation maximisation; the log evidence is exact for them.

    symbol    y  X  s^2       l      w            p      a      b     lambda  mu  k
    code      y  x  variance  error  curve_error  scale  sizes  bend  lam     mu  typical
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class BalanceRows(NamedTuple):
    """The rows (n,) of the balance and their errors, in V or Nm."""

    y: np.ndarray  # (n,) misfit
    variance: np.ndarray  # (n,) of the noise
    error: np.ndarray  # (n,) usual error of the balance
    curve_error: np.ndarray  # (n,) most that the curves of the effects may be wrong
    group: np.ndarray  # (n,) int, the group of a row, which has a discrepancy of its own
    groups: int  # number of groups
    loads: int  # the group whose rows may contain an unknown load torque; -1: none
    load: float  # scale of such a load


class Columns(NamedTuple):
    """The columns (k,) of a set of effects and what is known of their coefficients."""

    x: np.ndarray  # (k, n), so that loops over the rows run along the memory
    scale: np.ndarray  # (k,) coefficient that makes a column as large as its effect's floor
    owner: np.ndarray  # (k,) int, the effect of a column
    core: np.ndarray  # (k,) bool, a column of the formula and not of the free curve
    most: np.ndarray  # (effects,) largest size
    formula: np.ndarray  # (effects,) share of a contribution by which its formula may be wrong


class Prior(NamedTuple):
    """What holds for every set."""

    typical: float  # scale of the prior of lambda
    steep: float  # its exponent
    least: float  # smallest lambda
    straight: float  # smallest b
    always: float  # odds against a load at every operating point


class Found(NamedTuple):
    """The most probable sizes of a set, and its evidence with them."""

    log_evidence: float
    c: np.ndarray  # (k,) coefficients
    covariance: np.ndarray  # (k, k)
    sizes: np.ndarray  # (effects,) in units of the floor
    lam: np.ndarray  # (groups,) discrepancy
    mu: np.ndarray  # (groups,) share of the curves' errors that is seen
    strained: bool  # whether a row of the load's group has a load, or is further off than twice its error


def no_columns(n: int) -> Columns:
    """The empty set of effects over n rows."""
    none = np.zeros(0)
    return Columns(np.zeros((0, n)), none, np.zeros(0, np.int64), np.zeros(0, bool), none, none)
