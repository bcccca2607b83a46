"""Ties where one operating point, or one axis of current, is all there is, and what is asked for then."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import MACHINE, recorded
from fluxproof.diagnosis.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.search import Search
from fluxproof.diagnosis.ties import LONE_TIE
from fluxproof.diagnosis.verdict import groups

NOMINAL = load_nominal(PAPER)
RATED = NOMINAL.machine.rated_current_a


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def on_q_only(view):
    return view.take(np.abs(view.i.real.mean(axis=1)) < 0.05 * RATED)


def searched(view) -> Search:
    return Search(view, CATALOGUE, np.ones(len(view), bool))


def solved(*names, chi2=100.0, score=120.0, **c) -> Solution:
    return Solution(Model(frozenset(names)), chi2, 1, 1000, c=c, score=score)


def test_less_scatter_is_no_evidence_at_one_operating_point(view):
    """A delay that is none averages the voltages of two periods: its rows scatter less and tell nothing more."""
    one = view.take(np.resize(np.flatnonzero(view.run == 3), 60)).replace(course=np.linspace(0.0, 1.0, 60))
    lone = Search(one, {n: CATALOGUE[n] for n in ("resistance", "magnet_flux")}, np.ones(len(one), bool))
    use, noise = lone.cells.ok, np.random.default_rng(5).standard_normal(len(lone.cells.ok)) * lone.sigma

    def compared(scatter, offset):
        best, other = solved("resistance"), solved("magnet_flux")
        best.residual, other.residual = 0.94 * noise, scatter * noise + offset * lone.sigma
        for s in (best, other):
            s.view, s.chi2 = one, float(np.sum((s.residual / lone.sigma)[use] ** 2))
            s.score = s.chi2 / lone.dispersion
        assert other.score - best.score > LONE_TIE
        return lone.as_good(best, other, LONE_TIE)

    assert compared(1.0, 0.0)
    assert not compared(0.94, 0.5)  # but what stands there does
    assert not compared(1.4, 0.0)  # nor does a correction add so much


def test_equal_bus_and_current_scales_are_a_magnet_flux_error():
    of = lambda bus, scale: solved("udc_gain", "current_scale", udc_gain={"gain": bus}, current_scale={"scale": scale})  # noqa: E731
    assert Search.scaled_alike(of(-0.0134, -0.0138)) and not Search.scaled_alike(of(-0.0134, 0.0138))


def test_equal_resistance_and_inductance_errors_are_a_current_scale():
    """Without i_d nothing says that L_d is not off by the same."""
    m = MACHINE
    more = {"resistance_ohm": 1.1 * m.resistance_ohm, "inductance_q_h": 1.1 * m.inductance_q_h}
    view = view_of(recorded(machine=more), NOMINAL)
    names = frozenset(["resistance", "inductance_q"])
    for search, expected in ((searched(on_q_only(view)), {"current_scale"}), (searched(view), names)):
        pair = search.refine(Model(names))
        assert search._simplified(pair).model.names == expected
    assert searched(on_q_only(view)).impedance_alike(pair)
    pair.c["resistance"]["delta_r"] *= 0.8
    assert not searched(on_q_only(view)).impedance_alike(pair)


def test_superfluous_effect_is_no_alternative(view):
    """The best one holds a drift too small for a name; a skew in its place, no better than none, is not tied."""
    few = object.__new__(Search)
    few.view, few.effects, few.most, few.as_good = view, CATALOGUE, 2, lambda *args: True
    flux, tiny = {"delta_psi_m": 0.02 * MACHINE.magnet_flux_wb}, {"drift": 1e-5 * MACHINE.magnet_flux_wb}
    best = solved("magnet_flux", "magnet_temperature", magnet_flux=flux, magnet_temperature=tiny)
    skew = solved("magnet_flux", "sampling_skew", score=125.0, magnet_flux=flux, sampling_skew={"tau": 2e-6})
    for score, tied in ((124.0, []), (126.0, [skew])):
        alone = solved("magnet_flux", score=score, magnet_flux=flux)
        few.refined = {s.model: s for s in (best, skew, alone)}
        assert few._tied(best, True) == tied
    assert groups(best, [], CATALOGUE, NOMINAL, frozenset(["magnet_temperature"])) == (["magnet_flux"], [])


def test_saturation_has_inductance_rivals_at_one_current_level(view):
    """A wrong inductance of each axis is one effect more and no tie, but only another level of current tells."""
    levels = view.i.mean(axis=1)
    both = np.abs(levels - (-2.5 + 2j)) < 0.05 * RATED
    lone = searched(view.take(both & (view.run == view.run[both][0])))
    assert lone.most == 1
    bent, straight = lone.refine(Model(frozenset(["saturation"]))), {"inductance_d", "inductance_q"}
    (rival,) = lone.straightened([bent])
    assert rival.model.names == straight and rival.residual is not None
    assert not lone.straightened([bent, rival]) and not lone.straightened([rival])
    assert not searched(view).straightened([searched(view).refine(Model(frozenset(["saturation"])))])
