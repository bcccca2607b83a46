# SPDX-License-Identifier: BSD-3-Clause
"""What decides "ambiguous": each rule on groups of effects that take each other's place."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.decide.ambiguity import alternatives, ambiguities
from fluxproof.diagnosis.decide.bent import bent_groups
from fluxproof.diagnosis.decide.names import names_of
from fluxproof.diagnosis.decide.sized import with_sizes
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.inference.posterior import Posterior


def kept(*sets) -> list:
    """[(probability, names)] of (probability, effects)."""
    return [(p, tuple(names.split())) for p, names in sets]


def effects(*without_parameter) -> dict:
    return {n: SimpleNamespace(named=n not in without_parameter) for n in "abcd"}


def groups(sets, sure=(), beyond=()):
    present: dict = {}
    for p, names in sets:
        for n in names:
            present[n] = present.get(n, 0.0) + p
    return ambiguities(sets, present, sure, effects(*beyond))


def test_effects_of_which_either_will_do_are_ambiguous():
    assert groups(kept((0.6, "a c"), (0.4, "b c")), sure="c") == (("a", "b"),)


@pytest.mark.parametrize(
    "sets, beyond",
    [
        (kept((0.6, "a"), (0.4, "a b")), ""),  # b is added, and replaces nothing
        (kept((0.985, "a"), (0.015, "b")), ""),  # b is too improbable to be an alternative: OPEN
        (kept((0.5, "a"), (0.4, "b"), (0.1, "")), ""),  # neither may be there: DOUBTED
        (kept((0.6, "a"), (0.4, "b")), "ab"),  # no simulation carries either
    ],
)
def test_what_is_no_ambiguity(sets, beyond):
    assert groups(sets, beyond=beyond) == ()


KEYS = {"resistance": "delta_r", "magnet_flux": "delta_psi_m", "delay": "tau", "udc_gain": "gain"}


def found(*sets):
    """A posterior of sets (probability, {effect: (value, standard deviation)})."""
    nominal = load_nominal(PAPER)
    view = SimpleNamespace(nominal=nominal, has_voltage=np.ones(1, bool), shaft=np.array(["driving"]))
    setup = SimpleNamespace(effects=CATALOGUE, view=view)
    fits = {}
    for p, sizes in sets:
        names = tuple(sorted(sizes))
        c, cov = {n: {KEYS[n]: sizes[n][0]} for n in names}, np.diag([sizes[n][1] ** 2 for n in names])
        problem = SimpleNamespace(setup=setup, view=view, keys=[(n, KEYS[n]) for n in names])
        places = {n: [place] for place, n in enumerate(names)}
        fits[names] = SimpleNamespace(problem=problem, names=names, value=np.log(p), c=c, cov=cov, places=places)
    return Posterior(setup, fits)


def test_an_alternative_without_a_size_is_left_out():
    """A saturated machine was one of 18 causes, of which eight had sizes such as 0.6 +- 1.9 us."""
    sets = ((0.5, {"resistance": (0.3, 0.01)}), (0.3, {"magnet_flux": (0.01, 0.001)}),
            (0.2, {"delay": (6e-7, 1.9e-6), "magnet_flux": (0.01, 0.001)}))  # fmt: skip
    names = names_of(with_sizes(found(*sets)))
    assert names.ambiguous == (("magnet_flux", "resistance"),) and not names.possible
    assert ("delay", "magnet_flux", "resistance") in names_of(found(*sets)).ambiguous


@pytest.mark.parametrize("beside", [0.0002, 0.0013])
def test_a_name_whose_size_is_open_because_of_a_rival_is_an_ambiguity_with_it(beside):
    """A magnet flux of +13 %, and of +1 % beside a bus gain, was rejected from all sets: a resistance explained all."""
    always = {"resistance": (0.3, 0.01)}
    sets = ((0.6, always | {"magnet_flux": (0.01, 0.001)}),
            (0.35, always | {"magnet_flux": (beside, 0.001), "udc_gain": (0.12, 0.04)}),
            (0.05, always | {"udc_gain": (0.13, 0.01)}))  # fmt: skip
    names = names_of(with_sizes(found(*sets)))
    assert list(names.named) == ["resistance"] and names.ambiguous == (("magnet_flux", "udc_gain"),)
    assert not names.sizeless and not names.possible


def test_a_name_without_a_size_in_any_set_is_none():
    """A coefficient of 1.5 standard deviations may be certain, and says nothing of the drive."""
    posterior = with_sizes(found((1.0, {"resistance": (0.3, 0.01), "magnet_flux": (0.0015, 0.001)})))
    names = names_of(posterior)
    assert list(names.named) == ["resistance"] and list(names.sizeless) == ["magnet_flux"] and not names.ambiguous
    assert names.only_possible(posterior.best()) == {"magnet_flux"}


@pytest.mark.parametrize("agrees, first", [(True, ""), (False, "a")])
def test_a_misfit_that_is_no_noise_has_a_cause(agrees, first):
    """Resistance or dead time held 0.92 of the probability, none 0.07: nothing was said of a misfit of three floors."""
    fits = {names: SimpleNamespace(names=names, value=value) for names, value in (((), 1.0), (("a",), 0.0))}
    ((p, fit), *others) = Posterior(SimpleNamespace(), fits, agrees=agrees).weights()
    assert (
        "".join(fit.names) == first and len(others) == agrees and p == pytest.approx(1.0 if first else 0.731, abs=1e-3)
    )
    alone = Posterior(SimpleNamespace(), {(): fits[()]}, agrees=False)
    assert [fit.names for _, fit in alone.weights()] == [()]


@pytest.mark.parametrize(
    "bend, beside, groups", [(0.5, (), ()), (0.7, (), (("inductance_q", "saturation"),)), (0.7, ("saturation",), ())]
)
def test_an_inductance_that_changes_with_the_current_may_be_a_saturation(bend, beside, groups):
    """Of a measured flux map L_q was 'off the nameplate', with a bend of twice its size."""
    keys = [("inductance_q", "delta_l_q"), ("inductance_q", "bend_2")]
    points = SimpleNamespace(x=np.array([[1.0, 0.0], [0.0, 1.0]]), level=np.ones(2))
    cells = SimpleNamespace(free=frozenset(keys[1:]))
    problem = SimpleNamespace(setup=SimpleNamespace(effects=CATALOGUE), keys=keys, p=points, cells=cells)
    fit = SimpleNamespace(problem=problem, names=("inductance_q", *beside), take=[0, 1], vector=[1.0, bend],
                          places={"inductance_q": [0, 1]})  # fmt: skip
    assert bent_groups(("inductance_q", "resistance"), fit, CATALOGUE) == groups


def test_groups_are_connected():
    """Of a or b, and b or c, any may stand for another; d, in all sets, is no alternative."""
    assert alternatives([frozenset(x) for x in ("ad", "bd", "cd")]) == [{"a", "b", "c"}]
    assert alternatives([frozenset(x) for x in ("d", "ad", "abd")]) == []
