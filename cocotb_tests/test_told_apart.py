"""The rules that tell look-alikes apart: a drift from a constant, an inductance from saturation, ohms from a device."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.diagnosed_drives import MACHINE, recorded
from cocotb_tests.test_registers import PAPER
from diagnosis.blocks import view_of
from diagnosis.catalogue import CATALOGUE
from diagnosis.curvature import has_both, labels
from diagnosis.nominal import load_nominal
from diagnosis.request import wants_cold
from diagnosis.verdict import groups
from diagnosis.view import joined_views, started_cold

NOMINAL = load_nominal(PAPER)
COLD = NOMINAL.machine.temperature_ref_c


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def warm(view, temperature):
    return view.replace(temp=np.broadcast_to(np.asarray(temperature, float), view.t.shape).copy())


def test_a_further_recording_stands_where_its_temperature_says(view):
    course = lambda *parts: joined_views(list(parts)).course[len(view) :]  # noqa: E731
    heating = warm(view, np.linspace(COLD + 30.0, COLD + 80.0, len(view)))
    assert np.all(course(heating, view) >= 0.5)  # nothing is known of it: the time runs on
    assert np.all(course(heating, warm(view, COLD + 1.0)) == 0.0)
    middle = course(heating, warm(view, COLD + 55.0))
    assert np.ptp(middle) == 0.0 and middle[0] == pytest.approx(0.25, abs=0.03)  # half of the first half
    assert not started_cold(heating) and not started_cold(view)
    assert started_cold(joined_views([heating, warm(view, COLD + 1.0)]))
    assert wants_cold({"magnet_flux", "magnet_temperature"}) and not wants_cold({"delay", "sampling_skew"})


def solution(**c):
    return SimpleNamespace(c=c, model=SimpleNamespace(names=frozenset(c)))


def of(known, **c):
    """(asserted names, ambiguity sets) of a solution with nothing tied."""
    return groups(solution(**c), [], CATALOGUE, NOMINAL, **known)


def test_a_constant_beside_a_drift_is_both_only_where_warmth_cannot_be_it():
    both, psi = ["magnet_flux", "magnet_temperature"], MACHINE.magnet_flux_wb
    flux = lambda share: {"delta_psi_m": share * psi}  # noqa: E731
    drift = {"drift": -0.05 * psi}
    assert of({}, magnet_flux=flux(-0.05), magnet_temperature=drift) == (both[1:], [both])
    assert of({"cold": True}, magnet_flux=flux(-0.05), magnet_temperature=drift) == (both, [])
    assert of({}, magnet_flux=flux(+0.05), magnet_temperature=drift) == (both, [])


def test_ohms_beside_dead_time_are_a_resistance_where_no_device_has_them():
    i, dead = NOMINAL.machine.rated_current_a, {"v_0.02": 4.0, "v_0.12": 1.0}
    share = lambda x: {"delta_r": x * 5.0 / i}  # noqa: E731
    assert of({}, dead_time=dead, resistance=share(0.1))[0] == ["dead_time"]
    assert of({}, dead_time=dead, resistance=share(0.16)) == (["dead_time"], [["dead_time", "resistance"]])
    assert of({}, dead_time=dead, resistance=share(0.3)) == (["dead_time", "resistance"], [])
    assert of({}, dead_time=dead, resistance=share(-0.16)) == (["dead_time", "resistance"], [])


def test_a_curve_that_turns_its_sign_needs_an_inductance_and_saturation(view):
    l_q = MACHINE.inductance_q_h
    straight = solution(inductance_q={"delta_l_q": 0.2 * l_q})
    bent = solution(saturation={"q_3": -0.3})
    turning = solution(inductance_q={"delta_l_q": 0.1 * l_q}, saturation={"q_3": -0.3})
    assert not has_both(view, straight, "q") and labels(view, straight)[0] == {"inductance_q"}
    assert not has_both(view, bent, "q") and labels(view, bent)[0] == {"saturation"}
    assert has_both(view, turning, "q") and labels(view, turning)[0] == {"inductance_q", "saturation"}
