"""The flux map behind a recording: one free co-energy surface W(i_d, i_q) whose slopes are both fluxes.

    psi_d = L_d i_d + psi_m + dW/di_d        psi_q = L_q i_q + dW/di_q

W is a tensor of cubic B-splines, so the two fluxes are reciprocal by construction and each axis learns from the
other; no formula of saturation is assumed.  The balance of a block, mean over its rows, is linear in W:

    mean(u - R i - flux(psi_nominal)) = mean(flux(grad W)) + columns of what else may be there

Third differences of the coefficients are damped (P-splines: Eilers and Marx, Statistical Science 11, 1996), as
strongly as predicts operating points left out of the fit best.  Where nothing was recorded nothing is claimed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg, sparse
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from diagnosis.balance import misfit
from diagnosis.catalogue import CATALOGUE
from diagnosis.result import Estimate
from plant import FluxMap

INTERVALS = 22  # of the splines along each axis: finer than a machine's curves, the damping does the rest
DAMPING = tuple(10.0**k for k in range(-9, 2))  # relative to the mean diagonal of the normal matrix
FOLDS = 5
REACH = 0.75  # of the distance between neighbouring operating points: what lies nearer counts as covered
TINY = 1e-9  # damping of everything, so that what no row sees is zero: the constant of W among it
USUAL = ("resistance", "dead_time")  # what else may be there: neither is a flux, both follow the current


@dataclass
class Surface:
    """A fitted surplus co-energy and what was fitted beside it.

    knots_d, knots_q: knots of the cubic splines [A]; weights: (n_d, n_q) coefficients [J/1.5p: Wb A].
    points: (k,) complex operating points that were recorded, one per block [A]; spacing_a: between neighbours.
    beside: {effect: {coefficient: Estimate}} fitted along; damping: the chosen one.
    error_wb: rms error of the flux that operating points left out of the fit show, noise included.
    """

    machine: object
    knots_d: np.ndarray
    knots_q: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    spacing_a: float
    beside: dict = field(default_factory=dict)
    damping: float = 0.0
    error_wb: float = np.nan

    def surplus(self, i) -> np.ndarray:
        """Flux beyond the nominal one, complex [Wb], of dq currents of any shape, complex [A]."""
        flat = np.ravel(i)
        return (_gradients(flat, self.knots_d, self.knots_q) @ self.weights.ravel()).reshape(np.shape(i))

    def psi(self, i) -> np.ndarray:
        """Flux linkage, magnet included, complex [Wb], of dq currents of any shape, complex [A]."""
        m, i = self.machine, np.asarray(i)
        return m.inductance_d_h * i.real + m.magnet_flux_wb + 1j * m.inductance_q_h * i.imag + self.surplus(i)

    def covered(self, i) -> np.ndarray:
        """Whether dq currents lie within reach of an operating point that was recorded."""
        flat = np.ravel(i)
        distance, _ = cKDTree(_plane(self.points)).query(_plane(flat))
        return (distance <= REACH * self.spacing_a).reshape(np.shape(i))

    def flux_map(self, step_a: float) -> tuple[FluxMap, np.ndarray]:
        """(FluxMap over the recorded rectangle in steps of about step_a, (n, m) bool of what is covered)."""
        axes = [
            np.linspace(x.min(), x.max(), max(4, round(np.ptp(x) / step_a) + 1))
            for x in (self.points.real, self.points.imag)
        ]
        i = axes[0][:, None] + 1j * axes[1]
        psi = self.psi(i)
        return FluxMap(*axes, psi.real.copy(), psi.imag.copy()), self.covered(i)


def flux_map(view, beside=USUAL, train=None) -> Surface:
    """Fit the surface to the balance of a view's blocks.

    beside: names of effects whose usual columns are fitted along; train: (b,) blocks that take part.
    Raises ValueError where the recording does not spread over both currents.
    """
    return _Problem(view, beside, train).surface()


def earned(view, names, beside=USUAL, train=None) -> dict[str, float]:
    """{effect: what it explains beside the free surface, chi^2 over the dispersion}, one by one.

    A name given to what a rigid curve of saturation left over explains nothing any more beside a free one.
    """
    plain = _Problem(view, beside, train)
    _, damping = plain.chosen()
    rest = plain.chi2(damping)
    freedom = max(len(plain.y) - plain.effective(damping), 1.0)
    return {
        name: float((rest - _Problem(view, (*beside, name), train).chi2(damping)) * freedom / rest) for name in names
    }


class _Problem:
    """The damped least-squares problem of one view."""

    def __init__(self, view, beside, train):
        self.view = view
        use = np.ones(len(view), bool) if train is None else np.asarray(train, bool)
        i = view.i.mean(axis=1)[use]
        if min(np.ptp(i.real), np.ptp(i.imag)) < 0.1 * view.machine.rated_current_a:
            raise ValueError("a flux map needs operating points that spread over both i_d and i_q")
        self.points, self.run = i, view.run[use]
        self.omega = np.abs(view.omega.mean(axis=1))[use]
        self.knots = [_knots(view.i[use].real), _knots(view.i[use].imag)]
        self.sizes = [len(k) - 4 for k in self.knots]
        columns = [_slopes(view.take(use), *self.knots)]
        usual = np.sqrt(np.mean(np.sum(np.abs(columns[0]) ** 2, axis=0)))
        self.names, self.scale = [], []
        for name in beside:
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
        """Third differences along both axes, (k, k)."""
        n_d, n_q = self.sizes
        third = [np.diff(np.eye(n), 3, axis=0) for n in (n_d, n_q)]
        rough = np.kron(third[0].T @ third[0], np.eye(n_q)) + np.kron(np.eye(n_d), third[1].T @ third[1])
        n, k = n_d * n_q, len(self.names)
        out = np.zeros((n + k, n + k))
        out[:n, :n] = rough
        return out

    def _scaled(self, damping):
        n = self.sizes[0] * self.sizes[1]
        usual = np.mean(np.einsum("rk,rk->k", self.a[:, :n], self.a[:, :n]))
        return usual * (damping * self.penalty + TINY * np.eye(len(self.penalty)))

    def solve(self, damping, rows=slice(None)):
        """Coefficients for some of the rows."""
        a = self.a[rows]
        normal = a.T @ a + self._scaled(damping)
        return linalg.solve(normal, a.T @ self.y[rows], assume_a="pos")

    def chi2(self, damping) -> float:
        """Sum of squared residuals and penalty, which is what the solution makes least [V^2]."""
        c = self.solve(damping)
        return float(np.sum((self.y - self.a @ c) ** 2) + c @ self._scaled(damping) @ c)

    def effective(self, damping) -> float:
        """Effective number of coefficients."""
        gram = self.a.T @ self.a
        return float(np.trace(linalg.solve(gram + self._scaled(damping), gram, assume_a="pos")))

    def chosen(self) -> tuple[float, float]:
        """(rms of what is left at points left out [Wb], the damping that makes it least).

        Folds are whole dwells: neighbours in time would give each other away.
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
        c, n = self.solve(damping), self.sizes[0] * self.sizes[1]
        residual = self.y - self.a @ c
        variance = np.sum(residual**2) / max(len(residual) - self.effective(damping), 1.0)
        normal = self.a.T @ self.a + self._scaled(damping)
        half = linalg.solve(normal, self.a.T, assume_a="pos")[n:]
        scale = np.array(self.scale)
        spread = np.sqrt(variance * np.sum(half**2, axis=1)) * scale
        beside = {}
        for (name, key), value, sigma in zip(self.names, c[n:] * scale, spread, strict=True):
            beside.setdefault(name, {})[key] = Estimate(float(value), float(sigma), "")
        return Surface(
            self.view.machine, *self.knots, c[:n].reshape(self.sizes), self.points, _spacing(self.points), beside,
            damping, error,
        )  # fmt: skip


def _plane(i):
    return np.stack([np.real(i), np.imag(i)], axis=1)


def _spacing(points) -> float:
    """Usual distance between an operating point and the nearest other one [A]; blocks of one dwell are one point."""
    near = 0.02 * np.ptp(points.real) + 1e-9
    tree = cKDTree(_plane(points))
    kept = [k for k in range(len(points)) if not any(n < k for n in tree.query_ball_point(_plane(points)[k], near))]
    distance, _ = cKDTree(_plane(points[kept])).query(_plane(points[kept]), k=2)
    return float(np.quantile(distance[:, 1], 0.75))


def _knots(x) -> np.ndarray:
    """Knots of cubic splines over the range of x, a little wider."""
    low, high = x.min(), x.max()
    step = (high - low) * 1.02 / INTERVALS
    return 0.5 * (low + high) + step * (np.arange(-3, INTERVALS + 4) - 0.5 * INTERVALS)


def _gradients(i, knots_d, knots_q):
    """Sparse (p, n_d * n_q) complex: dB/di_d + j dB/di_q of every tensor spline at dq currents (p,)."""
    values, slopes = [], []
    for x, knots in ((i.real, knots_d), (i.imag, knots_q)):
        x = np.clip(x, knots[3], knots[-4] - 1e-9)
        value = BSpline.design_matrix(x, knots, 3)
        # The slope of a cubic B-spline on equal steps is the difference of two quadratic ones.
        lower = BSpline.design_matrix(x, knots[1:-1], 2)
        n, step = value.shape[1], knots[1] - knots[0]
        difference = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n))
        slopes.append((lower @ difference / step).tocsr())
        values.append(value.tocsr())
    return _product(slopes[0], values[1]) + 1j * _product(values[0], slopes[1])


def _product(first, second):
    """Row-wise Kronecker product of two sparse matrices with equally many rows."""
    p, n, m = first.shape[0], first.shape[1], second.shape[1]
    a, b = first.tocoo(), second.tocsr()
    counts = np.diff(b.indptr)[a.row]
    start = np.repeat(b.indptr[a.row], counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    at = start + within
    rows, columns = np.repeat(a.row, counts), np.repeat(a.col, counts) * m + b.indices[at]
    return sparse.csr_matrix((np.repeat(a.data, counts) * b.data[at], (rows, columns)), shape=(p, n * m))


def _slopes(view, knots_d, knots_q):
    """(b, n_d * n_q) complex: mean EMF of every tensor spline's flux over each block [V]."""
    b, samples = view.i.shape
    half = np.exp(0.5j * np.diff(view.theta, axis=1)) / view.sample_time_s / (samples - 1)
    weight = np.zeros((b, samples), complex)
    weight[:, 1:] += half
    weight[:, :-1] -= np.conj(half)
    mean = sparse.csr_matrix(
        (weight.ravel(), (np.repeat(np.arange(b), samples), np.arange(b * samples))), shape=(b, b * samples)
    )
    return (mean @ _gradients(view.i.ravel(), knots_d, knots_q)).toarray()
