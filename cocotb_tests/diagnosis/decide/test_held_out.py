# SPDX-License-Identifier: BSD-3-Clause
"""What an effect has to explain to be named."""

from types import SimpleNamespace

import numpy as np

from fluxproof.diagnosis.decide import held_out


def test_a_mean_torque_counts_beside_the_noise_of_its_ripple(monkeypatch):
    """A friction was dropped as one part in a thousand of the voltage's noise fitted better without it."""
    means, ripple, volts = np.arange(10), np.arange(10, 110), np.arange(110, 210)
    left, fewer, noise = (np.zeros(210) for _ in range(3))
    left[means], fewer[means], noise[means] = 0.2, 4.0, 0.6
    left[ripple], fewer[ripple], noise[ripple] = 30.0, 30.0, 50.0
    left[volts], fewer[volts], noise[volts] = 0.0900, 0.0899, 0.1
    cells = SimpleNamespace(
        channel=np.where(np.arange(210) < 110, "torque", "u"),
        order=np.where((np.arange(210) >= 10) & (np.arange(210) < 110), 34.0, 0.0),
        ok=np.ones(210, bool),
        block=np.zeros(210, int),
    )
    setup = SimpleNamespace(cells=cells, usual=noise, load=0.0)
    without = SimpleNamespace(names=(), left=lambda: fewer)
    best = SimpleNamespace(
        names=("a",),
        left=lambda: left,
        problem=SimpleNamespace(setup=setup, fit=lambda names: without),
    )
    monkeypatch.setattr(held_out, "_uncertain", lambda fit, rows: np.zeros(len(rows)))
    posterior = SimpleNamespace(best=lambda: best, setup=setup)
    assert held_out.helps(posterior, "a", np.ones(1, bool))
    left[means] = 4.1  # it explains nothing there
    assert not held_out.helps(posterior, "a", np.ones(1, bool))
