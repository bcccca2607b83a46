# SPDX-License-Identifier: BSD-3-Clause
"""What an effect has to explain to be named."""

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.decide import held_out
from fluxproof.diagnosis.decide.names import Names
from fluxproof.diagnosis.decide.relevant import relevant_names
from fluxproof.diagnosis.decide.sized import has_size
from fluxproof.diagnosis.ground.nominal import load_nominal

NOMINAL = load_nominal(PAPER)
KEYS = {"resistance": "delta_r", "magnet_flux": "delta_psi_m", "inductance_d": "delta_l_d", "inductance_q": "delta_l_q",
        "udc_gain": "gain", "current_scale": "share", "encoder_offset": "offset", "iron_loss": "g_fe",
        "demagnetisation": "step", "magnet_temperature": "drift", "machine_scale": "impedance"}  # fmt: skip


@pytest.mark.parametrize("name", sorted(KEYS))
def test_a_name_whose_size_is_compatible_with_zero_has_none(name):
    """A coefficient of 0 +- 30 and a flux of 0.6 +- 0.5 Wb were reported; drawn over sizes and signs."""
    effect, rng = CATALOGUE[name], np.random.default_rng(sorted(KEYS).index(name))
    for sigmas, seen in [(s, False) for s in rng.uniform(0.0, 1.9, 20)] + [
        (s, True) for s in rng.uniform(2.2, 99.0, 20)
    ]:
        value = float(effect.floor(NOMINAL) * 10 ** rng.uniform(0.3, 1.5))
        c = {KEYS[name]: value if name in ("iron_loss", "machine_scale") else value * rng.choice((-1.0, 1.0))}
        found = effect.estimates(c, np.diag([(value / sigmas) ** 2]), NOMINAL)
        assert has_size(found, effect, c, NOMINAL) is seen, (sigmas, c, found)


@pytest.mark.parametrize("name", sorted(KEYS))
def test_what_is_too_small_to_act_on_makes_no_verdict_and_hides_no_cause(name):
    """Offsets of 7 +- 4 mA of 15 A were explained; alone, beside a cause, and as an alternative to another one."""
    effect = CATALOGUE[name]
    problem = SimpleNamespace(setup=SimpleNamespace(effects=CATALOGUE), view=SimpleNamespace(nominal=NOMINAL))
    for times in np.random.default_rng(5).uniform(0.1, 3.0, 20).tolist():
        small = times * effect.relevant(NOMINAL)
        fit = SimpleNamespace(
            problem=problem, names=(name, "dead_time"), c={name: {KEYS[name]: small}, "dead_time": {"v_0.02": 9.0}}
        )
        found = relevant_names(Names({name: 0.99, "dead_time": 0.99}, (), {}, fits=((1.0, fit),)), fit)
        assert "dead_time" in found.named and (name in found.named) is (times >= 1.0)
        assert (name in found.minor) is (times < 1.0) and name not in found.only_possible(fit)
        either = relevant_names(Names({}, ((name, "dead_time"),), {}, fits=((1.0, fit),)), fit)
        assert either.ambiguous == ((name, "dead_time"),)  # one of them is large
        little = SimpleNamespace(problem=problem, names=("dead_time",), c={"dead_time": {"v_0.02": 1e-6}})
        both = Names({}, ((name, "dead_time"),), {}, fits=((0.6, fit), (0.4, little)))
        assert not relevant_names(both, fit).ambiguous  # nothing large is not improbable


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
