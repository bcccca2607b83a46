# SPDX-License-Identifier: BSD-3-Clause
"""What size an effect has to have to be named, and in which sets it has one."""

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.decide import likeliest
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


def found_set(c, explains):
    """A set with these coefficients, each effect explaining this part (2,) of the misfit per unit of its relevance."""
    sizes = {n: CATALOGUE[n].size(c[n], NOMINAL) / CATALOGUE[n].relevant(NOMINAL) for n in c}
    parts = {n: np.sign(next(iter(c[n].values()))) * sizes[n] * np.array(explains[n]) for n in c}
    problem = SimpleNamespace(
        setup=SimpleNamespace(effects=CATALOGUE, cells=SimpleNamespace(ok=np.ones(2, bool)), usual=np.ones(2)),
        view=SimpleNamespace(nominal=NOMINAL), y=np.zeros(2),
    )  # fmt: skip
    return SimpleNamespace(problem=problem, names=tuple(c), c=c, left=lambda names: -sum(parts[n] for n in names))


@pytest.mark.parametrize(("first", "second", "alike", "acted_on"), [
    (0.7, 0.7, (1.0, 0.0), True), (0.4, 0.4, (1.0, 0.0), False), (3.0, -3.0, (1.0, 0.2), False),
    (3.0, 0.1, (0.0, 1.0), True), (0.7, 0.95, (0.0, 1.0), False),
])  # fmt: skip
def test_causes_of_one_misfit_count_together(first, second, alike, acted_on):
    """Two halves of a cause that matters are one that matters; two that cancel are none, nor two small ones apart."""
    c = {
        "resistance": {"r": first * CATALOGUE["resistance"].relevant(NOMINAL)},
        "magnet_flux": {"psi": second * CATALOGUE["magnet_flux"].relevant(NOMINAL)},
    }
    fit = found_set(c, {"resistance": (1.0, 0.0), "magnet_flux": alike})
    found = relevant_names(Names({}, (("resistance", "magnet_flux"),), {}, fits=((1.0, fit),)), fit)
    assert bool(found.ambiguous) is acted_on


@pytest.mark.parametrize("name", sorted(KEYS))
def test_what_is_too_small_to_act_on_makes_no_verdict_and_hides_no_cause(name):
    """Offsets of 7 +- 4 mA of 15 A were explained; alone, beside a cause, and as an alternative to another one."""
    effect = CATALOGUE[name]
    for times in np.random.default_rng(5).uniform(0.1, 3.0, 20).tolist():
        small = times * effect.relevant(NOMINAL)
        fit = found_set({name: {KEYS[name]: small}, "dead_time": {"v_0.02": 9.0}}, {name: (1, 0), "dead_time": (0, 1)})
        found = relevant_names(Names({name: 0.99, "dead_time": 0.99}, (), {}, fits=((1.0, fit),)), fit)
        assert "dead_time" in found.named and (name in found.named) is (times >= 1.0)
        assert (name in found.minor) is (times < 1.0) and name not in found.only_possible(fit)
        either = relevant_names(Names({}, ((name, "dead_time"),), {}, fits=((1.0, fit),)), fit)
        assert either.ambiguous == ((name, "dead_time"),)  # one of them is large
        little = found_set({"dead_time": {"v_0.02": 1e-6}}, {"dead_time": (0, 1)})
        for share, told in ((0.5, False), (0.9, True)):  # of the sets with something large
            both = Names({}, ((name, "dead_time"),), {}, fits=((share, fit), (1.0 - share, little)))
            assert bool(relevant_names(both, fit).ambiguous) is told


@pytest.mark.parametrize(("after", "against"), [(0.2, "fit as well"), (0.8, "leaves 80 %"), (1.4, "held-out points")])
def test_the_best_fit_of_an_unexplained_misfit_is_told_with_what_speaks_against_it(monkeypatch, after, against):
    """Magnets that warm by 92 K were not mentioned, as held-out points lie beyond the fitted temperatures."""
    setup = SimpleNamespace(effects=CATALOGUE, cells=SimpleNamespace(y=1.0))
    fit = SimpleNamespace(names=("magnet_temperature",), left=lambda: after)
    nothing = SimpleNamespace(names=(), left=lambda: 1.0)
    searched = SimpleNamespace(
        setup=setup, weights=lambda: [(0.7, fit), (0.3, nothing)], present=lambda: {fit.names[0]: 0.7}
    )
    monkeypatch.setattr(likeliest, "_left", lambda setup, y, held: y)
    monkeypatch.setattr(likeliest, "estimates_in", lambda fit, name: {})
    found = likeliest.likeliest(searched, frozenset(), None)
    assert [e.name for e in found.effects] == ["magnet_temperature"] and against in found.against
