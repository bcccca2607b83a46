"""Several causes at once are called by their plain names: scales, ohms beside an inverter, a saturating inductance."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import MACHINE, recorded
from fluxproof.diagnosis.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.catalogue.saturation import q_curves
from fluxproof.diagnosis.curvature import has_both, straight_beside_saturation
from fluxproof.diagnosis.effect import flux, half_dead_time
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.ohms import straight_ohms
from fluxproof.diagnosis.search import Search
from fluxproof.diagnosis.verdict import groups

NOMINAL = load_nominal(PAPER)
RATED = NOMINAL.machine.rated_current_a


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


@pytest.fixture(scope="module")
def search(view):
    return Search(view, CATALOGUE, np.ones(len(view), bool))


def solved(*names, chi2=100.0, score=120.0, free=(), **c) -> Solution:
    return Solution(Model(frozenset(names), frozenset(free)), chi2, 1, 1000, c=c, score=score)


def stub(view, *solutions, **known):
    """A search that knows nothing but the solutions, {model: solution}, and what is given."""
    out = object.__new__(Search)
    out.view, out.effects, out.dispersion, out.most = view, CATALOGUE, 1.0, 4
    out.refined = {s.model: s for s in solutions}
    out.__dict__.update(known)
    return out


class Given:
    """A search whose misfit is the given one, {channel: array}: all of its fits see it in place of the recorded one."""

    def __init__(self, search, misfit):
        self.search, self.effects, self.projector = search, search.effects, search.projector
        self.dispersion, self.rows = 1.0, search.projector.rows(misfit)

    def fitter(self, view, effects):
        f = self.search.fitter(view, effects)
        f.y = self.rows[f.use] / f.sigma[f.use]
        return f


def test_delay_must_significantly_exceed_half_the_dead_time(search):
    """One edge of every pulse is late by the dead time: half of it is no delay, nor is what may be half of it."""
    dead = {"v_0.02": 0.04 * NOMINAL.inverter.dc_bus_v}
    half = half_dead_time({"dead_time": dead}, NOMINAL)
    for times, spread, small in ((1.05, 0.01, True), (1.2, 0.01, False), (1.2, 0.08, True), (1.5, 0.08, False)):
        found = solved("dead_time", "delay", dead_time=dead, delay={"tau": times * half})
        found.covariance["delay"] = np.array([[(spread * half) ** 2]])
        assert search.small(found, "delay") == small
    alone = solved("delay", delay={"tau": half})  # without dead time nothing needs to be known of its error
    assert not search.small(alone, "delay")


def test_two_scales_are_replaced_by_the_third_only_without_more_residual(view):
    """A bus and currents that are both wrong, by different factors, leave far more than noise to the magnets alone."""
    both = solved("udc_gain", "current_scale", chi2=2754.0, score=2800.0)
    nothing = solved(chi2=4e5, score=4e5)
    for left, wins in ((3000.0, True), (10161.0, False)):
        magnets = solved("magnet_flux", chi2=left, score=left + 20.0)
        bent = solved("magnet_flux", free=["magnet_flux"], chi2=left, score=left + 30.0)
        found = stub(view, both, nothing, magnets, bent)._simplified(both)
        assert found is (magnets if wins else both)


def test_any_two_of_three_scales_are_equivalent(view):
    """A drift keeps the magnets' constant in its free form: the price of that form is no evidence against them."""
    gain, scale, psi = {"gain": 0.009}, {"scale": -0.009}, {"delta_psi_m": 0.02 * MACHINE.magnet_flux_wb}
    best = solved("udc_gain", "current_scale", udc_gain=gain, current_scale=scale)
    other = solved("magnet_flux", "current_scale", score=145.0, magnet_flux=psi, current_scale=scale)
    other.count = best.count + 3
    beside = solved("magnet_flux", "delay", score=145.0, magnet_flux=psi, delay={"tau": 5e-5})
    beside.count = other.count
    search = stub(view, best, other, beside, linear=SimpleNamespace(price=8.5))
    search.as_good = lambda best, other, margin: other.score < best.score + margin
    assert search._tied(best, True) == [other]


def test_current_scale_with_one_inductance_equals_resistance_and_the_other_inductance(view):
    """Currents of 0.94 with L_q of 0.94 leave L_q as it is: R is wrong, and L_d by another amount."""
    m, psi = view.machine, {"alpha": 0.007, "beta": -0.012}
    nothing = solved(chi2=4e5, score=4e5)
    plain = solved("current_gain", "inductance_d", "resistance", chi2=1500.0, free=["inductance_d"])
    alone = solved("inductance_d", "resistance", chi2=9000.0, free=["inductance_d"])

    def called(share, noise=1.2):
        l_d, l_q = {"delta_l_d": 0.3 * m.inductance_d_h}, {"delta_l_q": share * m.inductance_q_h}
        names = ("current_gain", "inductance_d", "inductance_q")
        best = solved(*names, chi2=1090.0, free=names, current_gain={**psi, "common": -0.058})
        best.c |= {"inductance_d": l_d, "inductance_q": l_q}
        best.view = view.replace(noise_gain=noise)  # larger currents have larger noise, and a smaller chi^2
        known = {"take_raw": lambda solutions: None, "_climbed": lambda s: s}
        return stub(view, best, nothing, plain, alone, **known)._unscaled(best).model

    assert called(-0.0576) == plain.model
    assert called(-0.0576, noise=1.0) != plain.model
    assert called(-0.02).names == called(0.058).names == {"current_gain", "inductance_d", "inductance_q"}


def test_effects_hidden_by_a_removed_one_are_searched_again(view):
    """A cross-saturation that did not earn its place had taken up unequal phases as well."""
    found = solved("dead_time", "magnet_flux", score=400.0)
    more = solved("dead_time", "magnet_flux", "phase_resistance_asymmetry", score=300.0)
    idle = solved("dead_time", "magnet_flux", "delay", score=200.0)
    search = stub(view, found, more, idle, _neighbours=lambda best: None)
    search._earning = lambda s: found if s is idle else s
    assert search._completed(found) is more
    search._earning = lambda s: found
    assert search._completed(found) is found


def loss(view, **parts):
    """Misfit of an inverter's loss with so many volts of each part: flat, log, fade, ohms."""
    x = view.phases(view.with_raw_current().i_mid) / RATED
    above = np.maximum(np.abs(x) / 0.12, 1.0)
    shapes = {"log": np.sign(x) * np.log(above), "fade": np.sign(x) * (1.0 - 1.0 / above)}
    columns = {name: {"u": view.from_phases(shape)} for name, shape in shapes.items()}
    columns["flat"] = CATALOGUE["dead_time"].core(view)["v_0.02"]
    columns["ohms"] = {"u": CATALOGUE["resistance"].core(view)["delta_r"]["u"] / RATED}
    return {"u": sum(volts * columns[name]["u"] for name, volts in parts.items())}


def test_straight_ohms_exclude_device_drops(view, search):
    """A drop in log(i) looks like ohms beside a curve that ends; beside its own it leaves none."""
    names = frozenset(["dead_time", "resistance"])
    both = search.refine(Model(names, frozenset(["dead_time"])))

    def judged(**parts):
        least, most = straight_ohms(Given(search, loss(view, **parts)), both)
        assert least < most
        return least, most

    for none in (judged(flat=5.0), judged(flat=5.0, log=0.5), judged(flat=5.0, fade=0.5)):
        assert none[0] < 0.05 < 0.15 + none[1]
    least, most = judged(flat=5.0, ohms=1.0)
    assert 0.8 < least < 1.0 < most < 1.2
    assert judged(flat=5.0, log=0.5, ohms=1.0)[0] > 0.3


def test_unexplained_ohms_are_a_resistance(view):
    """By the share alone 0.4 V of 5 V are the device's, and nobody knows of 0.8 V."""
    both = ["dead_time", "resistance"]

    def named(volts, straight, growth=0.0):
        dead = {"v_0.02": 4.0, "v_0.12": 1.0 - growth, "growth": growth}
        found = solved(*both, dead_time=dead, resistance={"delta_r": volts / RATED})
        found.view = view
        found.covariance = {name: np.zeros((len(c),) * 2) for name, c in found.c.items()}
        return groups(found, [], CATALOGUE, NOMINAL, straight=straight)

    assert named(0.4, None) == named(0.4, (0.1, 0.5)) == (["dead_time"], [])
    assert named(0.4, (0.3, 0.5)) == (both, [])
    assert named(0.8, None, 0.2) == named(0.8, (0.18, 0.9), 0.2) == (["dead_time"], [both])
    assert named(0.8, (0.1, 0.9)) == (["dead_time"], [])


def test_saturation_has_no_linear_part(view, search):
    """A curve in |i| i, as iron with a knee far out has it, is no wrong inductance; one with a straight part is."""
    best = search.refine(Model(frozenset(["saturation"]), frozenset(["saturation"])))
    straight, knee, cubic, _ = q_curves(view)
    for psi, both in ((-0.3 * knee, False), (-0.3 * cubic, False), (0.1 * straight - 0.3 * knee, True)):
        given = Given(search, flux(view, psi))
        assert straight_beside_saturation(given, best) == both
    small = Given(search, flux(view, 0.025 * straight - 0.3 * cubic))
    assert not straight_beside_saturation(small, best)


def test_fast_falling_inductance_includes_saturation(view):
    """From 0.4 to 0.85 of rated current the surplus falls by a quarter: from none to rated by nearly half."""
    level = np.where(np.arange(len(view)) % 2, 0.4, 0.85)[:, None] * RATED
    near = view.replace(i=1j * level * np.ones_like(view.i), memo={})
    l_q = NOMINAL.machine.inductance_q_h
    names = dict.fromkeys(("inductance_q", "saturation"), np.zeros((1, 1)))
    wrong = {"delta_l_q": 0.14 * l_q}
    falling = SimpleNamespace(c={"inductance_q": wrong, "saturation": {"q_3": -0.06}}, covariance=names)
    rounded = SimpleNamespace(c={"inductance_q": {**wrong, "bend_3": -0.016 * l_q}}, covariance=names)
    assert has_both(near, falling, "q") and not has_both(near, rounded, "q")
