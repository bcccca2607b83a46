# SPDX-License-Identifier: BSD-3-Clause
"""Harmonics of the magnet flux: orders 6 and 12 in dq, proportional to speed, also at zero current."""

import numpy as np

from fluxproof.diagnosis.effects import Described, FreeCurve, Orders, Parameter, Wave, flux, torque_of
from fluxproof.diagnosis.ground.result import Estimate


def _order(view, h):
    """The four terms of an order: forward and backward, cosine and sine, per unit of the magnet flux."""
    psi_m = view.machine.magnet_flux_wb
    turn = np.exp(1j * h * view.theta)
    terms = {"fc": (turn, h), "fs": (1j * turn, h), "bc": (np.conj(turn), -h), "bs": (1j * np.conj(turn), -h)}
    return {Wave(h, key): _with_reluctance(view, psi_m * term, n) for key, (term, n) in terms.items()}


def _with_reluctance(view, psi, n):
    """Flux of order n in dq: its angle derivative also contributes to the torque, n Im(conj(psi) i)."""
    column = flux(view, psi)
    column["torque"] = column["torque"] + torque_of(view, n * psi, view.i)
    return column


def _dq(c, h):
    """Amplitudes (a_d, a_q) and phase of plant.Harmonic: a_d cos(h theta + phi), a_q sin(h theta + phi)."""
    fc, fs, bc, bs = (c.get(Wave(h, part), 0.0) for part in ("fc", "fs", "bc", "bs"))
    forward, backward = fc + 1j * fs, bc + 1j * bs
    d, q = forward + np.conj(backward), forward - np.conj(backward)
    phi = float(np.angle(d if abs(d) >= abs(q) else q))
    return float((d * np.exp(-1j * phi)).real), float((q * np.exp(-1j * phi)).real), phi


class EmfHarmonics(FreeCurve, Described):
    def core(self, view):
        return _order(view, 6)

    def free(self, view):
        return {**_order(view, 12), **_order(view, 18)}

    def floor(self, nominal):
        return 0.0003

    def relevant(self, nominal):
        return 0.002

    def ceiling(self, nominal):
        return 0.3

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    def estimates(self, c, covariance, nominal):
        out = {}
        for h in (6, 12):
            index = [k for k, wave in enumerate(c) if wave.order == h]
            if index:
                values = np.array(list(c.values()))[index]
                size = float(np.sqrt(np.sum(values**2)))
                spread = float(np.sqrt(np.trace(covariance[np.ix_(index, index)]) / len(index)))
                if size or spread:  # an order that no row determines is unknown, not zero
                    out[f"order_{h}"] = Estimate(size, spread, "1")
        return out

    def given(self, view, plant):
        out = {}
        for harmonic in plant.machine.emf_harmonics:
            wave = view.machine.magnet_flux_wb * np.exp(1j * (harmonic.order * view.theta + harmonic.phase_rad))
            d, q = harmonic.amplitude_d, harmonic.amplitude_q
            for psi, n in ((0.5 * (d + q) * wave, harmonic.order), (0.5 * (d - q) * np.conj(wave), -harmonic.order)):
                for channel, values in _with_reluctance(view, psi, n).items():
                    out[channel] = out.get(channel, 0.0) + values
        return out

    def plant(self, c, nominal):
        rows = []
        for h in (6, 12, 18):
            if any(wave.order == h for wave in c):
                d, q, phi = _dq(c, h)
                rows.append([float(h), d, q, phi])
        return {"machine.emf_harmonics": rows}


EFFECT = EmfHarmonics(
    name="emf_harmonics",
    title="harmonics of the magnet flux",
    equation="psi_dq = ... + psi_m sum_h (a_d cos(h theta + phi) + j a_q sin(h theta + phi)), h = 6, 12, 18",
    signature="orders 6 and 12 in dq, proportional to speed, also at zero current",
    separated_by="two speeds; rotation at zero current",
    parameters=(
        Parameter("order_6", "1", "amplitude relative to the magnet flux", "order 6"),
        Parameter("order_12", "1", "amplitude relative to the magnet flux", "order 12"),
    ),
    plausible={"order_6": (0.0, 0.2), "order_12": (0.0, 0.2)},
    otherwise="a machine for block commutation, or an angle that is not linear over the turn",
    needs=("harmonics",),
    shows_at=Orders((6.0, 12.0, 18.0), trailing=(12.0, 18.0, 24.0)),
)
