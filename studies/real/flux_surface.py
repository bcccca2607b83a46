# SPDX-License-Identifier: BSD-3-Clause
"""Flux map from a recording: one free co-energy surface W(i_d, i_q) whose partial derivatives are both fluxes.

    psi_d = L_d i_d + psi_m + dW/di_d        psi_q = L_q i_q + dW/di_q

W is a tensor product of cubic B-splines, so that the two fluxes are reciprocal by construction and each axis is also
determined by the other; no saturation formula is assumed.  The balance of a block, averaged over its rows, is linear
in W:

    mean(u - R i - flux(psi_nominal)) = mean(flux(grad W)) + columns of other effects

Third differences of the coefficients are penalised (P-splines: Eilers and Marx, Statistical Science 11, 1996); the
strength is chosen by cross-validation over operating points.  The map is valid only where the recording has points.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg
from scipy.spatial import Delaunay, cKDTree

from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.machine import flux_linkage
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant import FluxMap
from studies.real.flux_splines import emf_columns, gradients, knots_over, powers

BETTER = 1.3
DAMPING = tuple(10.0**k for k in range(-9, 2))  # relative to the mean diagonal of the normal matrix
FOLDS = 5
LONGEST = 2.0  # times the median triangle of recorded points: a larger one spans an area without data
TINY = 1e-9  # damping of all coefficients, so that undetermined ones, such as the constant of W, are zero
SHAPES = (
    "linear",
    "separable",
    "full",
)  # inductances and magnet flux; a separate curve per axis; any reciprocal surface
SHAPES_OF = {  # {effect: shapes of a map without it and with it}
    "saturation": ("linear", "separable"),
    "cross_saturation": ("separable", "full"),
}
BESIDE = ("dead_time", "resistance")  # functions of the current that are no flux: fitted together with a map


@dataclass
class Surface:
    """A fitted excess co-energy and the effects fitted with it.

    knots_d, knots_q: knots of the cubic splines [A]; weights: (n_d, n_q) coefficients [J/1.5p: Wb A].
    points: (k,) complex operating points that were recorded, one per dwell [A].
    beside: {effect: {coefficient: Estimate}} fitted with it; damping: the chosen one.
    error_wb: rms error of the flux at operating points left out of the fit, including noise.
    """

    machine: object
    knots_d: np.ndarray
    knots_q: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    beside: dict = field(default_factory=dict)
    damping: float = 0.0
    error_wb: float = np.nan

    def surplus(self, i) -> np.ndarray:
        """Excess over the nominal flux, complex [Wb], at dq currents of any shape, complex [A]."""
        flat = np.ravel(i)
        return (gradients(flat, self.knots_d, self.knots_q) @ self.weights.ravel()).reshape(np.shape(i))

    def psi(self, i) -> np.ndarray:
        """Flux linkage including the magnet, complex [Wb], at dq currents of any shape, complex [A]."""
        i = np.asarray(i)
        return flux_linkage(self.machine, i) + self.surplus(i)

    def covered(self, i) -> np.ndarray:
        """Whether dq currents (any shape) lie between neighbouring recorded operating points, bool."""
        triangles = Delaunay(_plane(self.points))
        corners = self.points[triangles.simplices]
        longest = np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=1)
        small = np.append(longest <= LONGEST * np.median(longest), False)  # the last entry means "outside"
        return small[triangles.find_simplex(_plane(np.ravel(i)))].reshape(np.shape(i))

    def residual(self, view) -> np.ndarray:
        """Residual of each block's mean misfit, (b,) complex dq [V]."""
        left = misfit(view)["u"].mean(axis=1) - emf_columns(view, self.knots_d, self.knots_q) @ self.weights.ravel()
        for name, found in self.beside.items():
            columns = CATALOGUE[name].core(view)
            left = left - sum(e.value * columns[key]["u"].mean(axis=1) for key, e in found.items())
        return left

    def flux_map(self, step_a: float) -> tuple[FluxMap, np.ndarray]:
        """(FluxMap over the recorded rectangle in steps of about step_a, (n, m) bool: covered by recorded points)."""
        axes = [
            np.linspace(x.min(), x.max(), max(4, round(np.ptp(x) / step_a) + 1))
            for x in (self.points.real, self.points.imag)
        ]
        i = axes[0][:, None] + 1j * axes[1]
        psi = self.psi(i)
        return FluxMap(*axes, psi.real.copy(), psi.imag.copy()), self.covered(i)


def flux_map(view, beside=None, train=None, shape="full") -> Surface:
    """Fit the surface to the balance of a view's blocks.

    beside: names of effects whose core columns are fitted with it, None: the usual ones; train: (b,) bool, blocks to
    fit; shape: one of SHAPES.  Raises ValueError if the recording does not cover a range of both currents.
    """
    return _Problem(view, beside, train, shape).surface()


def ladder(view, train, beside=None) -> dict[str, dict]:
    """{shape: {"train", "holdout": rms misfit [V]}} of co-energies with increasing freedom, the nominal one first.

    If "separable" predicts better than "linear", the machine has saturation; if "full" predicts better than
    "separable", it has cross-saturation.  The names depend on the variables of the flux and not on a formula.
    train: (b,) bool, blocks to fit; the others are held out.
    """
    rows = {"nominal": misfit(view)["u"].mean(axis=1)}
    rows |= {shape: flux_map(view, beside, train, shape).residual(view) for shape in SHAPES}
    return {shape: {"train": _rms(left[train]), "holdout": _rms(left[~train])} for shape, left in rows.items()}


def names(steps: dict[str, dict], noise_v: float) -> list[str]:
    """Names that follow from a ladder: each step must predict BETTER times better and by more than the noise."""
    found = []
    for name, (before, after) in SHAPES_OF.items():
        worse, better = steps[before]["holdout"], steps[after]["holdout"]
        if worse > BETTER * better and worse**2 - better**2 > noise_v**2:
            found.append(name)
    return found


def earned(view, names, beside=None, train=None) -> dict[str, float]:
    """{effect: gain in chi^2 over the dispersion, in addition to the free surface}, each effect alone.

    An effect that only absorbed the residual of a rigid saturation curve gains nothing in addition to a free one.
    """
    plain = _Problem(view, beside, train)
    _, damping = plain.chosen()
    rest = plain.chi2(damping)
    freedom = max(len(plain.y) - plain.effective(damping), 1.0)
    return {
        name: float((rest - _Problem(view, (*_beside(beside), name), train).chi2(damping)) * freedom / rest)
        for name in names
    }


class _Problem:
    """The damped least-squares problem of one view.  ``basis`` (n, k): spline weights of each coefficient."""

    def __init__(self, view, beside, train, shape="full"):
        self.view = view
        use = np.ones(len(view), bool) if train is None else np.asarray(train, bool)
        i = view.i.mean(axis=1)[use]
        if min(np.ptp(i.real), np.ptp(i.imag)) < 0.1 * view.machine.rated_current_a:
            raise ValueError("a flux map needs operating points that cover a range of both i_d and i_q")
        self.points, self.run = i, view.run[use]
        self.omega = np.abs(view.omega.mean(axis=1))[use]
        self.knots = [knots_over(view.i[use].real), knots_over(view.i[use].imag)]
        self.sizes = [len(k) - 4 for k in self.knots]
        self.basis = _basis(shape, *self.knots)
        columns = [emf_columns(view.take(use), *self.knots) @ self.basis]
        usual = np.sqrt(np.mean(np.sum(np.abs(columns[0]) ** 2, axis=0)))
        self.names, self.scale = [], []
        for name in _beside(beside):
            for key, column in CATALOGUE[name].core(view).items():
                mean = column["u"].mean(axis=1)[use][:, None]
                self.names.append((name, key))
                self.scale.append(usual / max(np.linalg.norm(mean), 1e-12))
                columns.append(mean * self.scale[-1])
        a = np.hstack(columns)
        self.a = np.vstack([a.real, a.imag])
        y = misfit(view)["u"].mean(axis=1)[use]
        self.y = np.concatenate([y.real, y.imag])
        self.penalty = self._penalty()

    def _penalty(self):
        """Penalty matrix (k, k) of the third differences along both axes."""
        n_d, n_q = self.sizes
        third = [np.diff(np.eye(n), 3, axis=0) for n in (n_d, n_q)]
        rough = np.kron(third[0].T @ third[0], np.eye(n_q)) + np.kron(np.eye(n_d), third[1].T @ third[1])
        n, k = self.basis.shape[1], len(self.names)
        out = np.zeros((n + k, n + k))
        out[:n, :n] = self.basis.T @ rough @ self.basis
        return out

    def _scaled(self, damping):
        n = self.basis.shape[1]
        usual = np.mean(np.einsum("rk,rk->k", self.a[:, :n], self.a[:, :n]))
        return usual * (damping * self.penalty + TINY * np.eye(len(self.penalty)))

    def solve(self, damping, rows=slice(None)):
        """Coefficients fitted to the given rows."""
        a = self.a[rows]
        normal = a.T @ a + self._scaled(damping)
        return linalg.solve(normal, a.T @ self.y[rows], assume_a="pos")

    def chi2(self, damping) -> float:
        """Sum of squared residuals and penalty [V^2], which the solution minimises."""
        c = self.solve(damping)
        return float(np.sum((self.y - self.a @ c) ** 2) + c @ self._scaled(damping) @ c)

    def effective(self, damping) -> float:
        """Effective number of coefficients."""
        gram = self.a.T @ self.a
        return float(np.trace(linalg.solve(gram + self._scaled(damping), gram, assume_a="pos")))

    def chosen(self) -> tuple[float, float]:
        """(rms error at the points left out [Wb], damping that minimises it), by cross-validation.

        Folds are whole dwells, since neighbouring blocks are not independent.
        """
        fold = np.unique(self.run, return_inverse=True)[1] * 7 % FOLDS
        fold, speed = np.tile(fold, 2), np.tile(np.maximum(self.omega, 1e-9), 2)
        turning = speed > 0.2 * speed.max()
        scores = []
        for damping in DAMPING:
            left = np.zeros(len(self.y))
            for n in range(FOLDS):
                out = fold == n
                left[out] = self.y[out] - self.a[out] @ self.solve(damping, ~out)
            scores.append(np.sqrt(np.mean((left / speed)[turning] ** 2)))
        k = int(np.argmin(scores))
        return float(scores[k]), DAMPING[k]

    def surface(self) -> Surface:
        error, damping = self.chosen()
        c, n = self.solve(damping), self.basis.shape[1]
        residual = self.y - self.a @ c
        variance = np.sum(residual**2) / max(len(residual) - self.effective(damping), 1.0)
        normal = self.a.T @ self.a + self._scaled(damping)
        half = linalg.solve(normal, self.a.T, assume_a="pos")[n:]
        scale = np.array(self.scale)
        spread = np.sqrt(variance * np.sum(half**2, axis=1)) * scale
        beside = {}
        for (name, key), value, sigma in zip(self.names, c[n:] * scale, spread, strict=True):
            beside.setdefault(name, {})[key] = Estimate(float(value), float(sigma), "")
        weights = (self.basis @ c[:n]).reshape(self.sizes)
        return Surface(self.view.machine, *self.knots, weights, _apart(self.points), beside, damping, error)


def _beside(names) -> tuple[str, ...]:
    """Effects that are fitted together with a map; by default the functions of the current that are no flux."""
    return BESIDE if names is None else tuple(names)


def _basis(shape, knots_d, knots_q):
    """(n_d * n_q, k) weights of the tensor splines for each coefficient of a shape."""
    x, y = powers(knots_d), powers(knots_q)
    one_d, one_q = x[0], y[0]
    if shape == "linear":
        columns = [np.outer(p, one_q) for p in x[1:]] + [np.outer(one_d, p) for p in y[1:]]
        return np.stack([c.ravel() / np.abs(c).max() for c in columns], axis=1)
    n_d, n_q = len(one_d), len(one_q)
    if shape == "separable":
        return np.hstack([np.kron(np.eye(n_d), one_q[:, None]), np.kron(one_d[:, None], np.eye(n_q))])
    return np.eye(n_d * n_q)


def _rms(x) -> float:
    return float(np.sqrt(np.mean(np.abs(x) ** 2)))


def _plane(i):
    return np.stack([np.real(i), np.imag(i)], axis=1)


def _apart(points, share=0.03) -> np.ndarray:
    """One point of each group closer than a share of the range, so that a dwell is one point."""
    tree, near = cKDTree(_plane(points)), share * max(np.ptp(points.real), np.ptp(points.imag))
    around = tree.query_ball_point(_plane(points), near)
    kept = np.ones(len(points), bool)
    for k, neighbours in enumerate(around):
        kept[k] = not any(n < k and kept[n] for n in neighbours)
    return points[kept]
