"""Dead time at an operating point without current resembles other effects and is added as a rival."""

from __future__ import annotations

import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import MACHINE, recorded
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.idle import carries_none, unseen_loss
from fluxproof.diagnosis.nominal import load_nominal

NOMINAL = load_nominal(PAPER)
BUS, PERIOD = NOMINAL.inverter.dc_bus_v, NOMINAL.sample_time_s
STILL = ((160.0, 0.0, 0.0),) * 20


@pytest.fixture(scope="module")
def still():
    return view_of(recorded(STILL, machine={"magnet_flux_wb": 0.97 * MACHINE.magnet_flux_wb}), NOMINAL)


def said(**c) -> Solution:
    return Solution(Model(frozenset(c)), 100.0, 1, 1000, c=c, score=120.0)


def loss_of(view, *solutions) -> float:
    """Loss [V] of the dead time that is added to the solutions, 0 if none is."""
    beside = unseen_loss(view, CATALOGUE["dead_time"], solutions)
    return CATALOGUE["dead_time"].size(beside[0].c["dead_time"], NOMINAL) if beside else 0.0


def test_late_pulses_may_be_due_to_dead_time(still):
    late = {"tau": 0.02 * PERIOD}
    assert loss_of(still, said(delay=late)) == loss_of(still, said(sampling_skew=late)) == pytest.approx(0.02 * BUS)
    assert not loss_of(still, said(delay={"tau": -0.02 * PERIOD}))  # dead time cannot make them early
    assert not loss_of(still, said(delay={"tau": PERIOD}))  # nor late by a whole period
    assert not loss_of(still, said(delay=late), said(dead_time={"v_0.02": 1.0}))


def test_missing_flux_may_be_due_to_dead_time(still):
    less, more = ({"delta_psi_m": share * MACHINE.magnet_flux_wb} for share in (-0.005, 0.005))
    lacking = loss_of(still, said(magnet_flux=less))
    assert 0.0 < lacking == pytest.approx(loss_of(still, said(udc_gain={"gain": -0.005})))
    assert not loss_of(still, said(magnet_flux=more))


def test_with_current_the_loss_curve_is_visible(still):
    assert carries_none(still)
    loaded = still.replace(i=still.i + 0.5j * NOMINAL.machine.rated_current_a)
    assert not carries_none(loaded) and not loss_of(loaded, said(delay={"tau": 0.02 * PERIOD}))


def test_missing_flux_at_zero_current_is_found_or_open():
    answer = diagnose(recorded(STILL, machine={"magnet_flux_wb": 0.995 * MACHINE.magnet_flux_wb}), NOMINAL)
    assert {e.name for e in answer.effects} <= {"magnet_flux"}
    assert answer.effects or any("magnet_flux" in group for group in answer.ambiguity)
