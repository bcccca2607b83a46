# SPDX-License-Identifier: BSD-3-Clause
"""A recording with any effect of the catalogue, made from a healthy one and the effect's own column.

The column of every row is added to the duties and to the torque: the drive that needs this voltage has the effect.  So
there is a recording for every effect, also for one that a file adds to the catalogue.
"""

from __future__ import annotations

import functools

import numpy as np

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import DRIVE, GRID, columns
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.misfit import shaft_torque
from fluxproof.diagnosis.effects import Drift, ShaftTorque
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns

NOMINAL = load_nominal(PAPER)
T = DRIVE.sample_time_s
PLAN = GRID
ROWS = 200  # of a block
FLOORS, SHARE = 16.0, 0.3  # size of an effect: this many times its floor, at most this share of its ceiling
WARM_C = 60.0  # of the winding at the end
NOISE_NM = 0.02
TURNS = np.exp(-2j * np.pi / 3 * np.arange(3))


@functools.lru_cache
def healthy():
    """(columns, view of all rows) of the healthy drive with a torque transducer and a winding that warms up."""
    table = dict(columns(PLAN))
    count = (len(table["t"]) - 1) // ROWS * ROWS + 1  # whole blocks: the effect is in every row, to the last
    table = {name: values[:count] for name, values in table.items()}
    table |= {"temp_winding": np.linspace(20.0, WARM_C, count), "torque": np.zeros(count)}
    view = all_rows(table)
    table["torque"] = at_samples(shaft_torque(view, view), count)
    table["torque"] += NOISE_NM * np.random.default_rng(7).standard_normal(count)
    return table, view


def all_rows(table):
    """All rows as consecutive blocks, the transients too, so that the effect is in every row."""
    template = view_of(from_columns(table, T), NOMINAL)
    first = np.arange(0, len(table["t"]) - 1, ROWS)
    at = first[:, None] + np.arange(ROWS + 1)
    theta = np.unwrap(table["theta_e"])
    i_raw = (2 / 3) * np.stack([table[f"i_{x}"] for x in "abc"], axis=1) @ np.conj(TURNS)
    blocks = len(first)
    return template.replace(
        theta=theta[at],
        omega=table["omega_e"][at],
        i=(i_raw * np.exp(-1j * theta))[at],
        i_raw=i_raw[at],
        i_abc=None,
        u=np.zeros((blocks, ROWS + 2), complex),
        u_dc=table["u_dc"][at[:, :-1]],
        t=table["t"][first],
        course=np.linspace(0.0, 1.0, blocks),
        temp=table["temp_winding"][first],
        torque=np.zeros((blocks, ROWS)),
        slope_m=np.zeros((blocks, ROWS)),
        shaft=np.full(blocks, "torque"),
        run=np.arange(blocks),
        rows=first,
        lacks=None,
        memo={},
    )


def at_samples(values, count):
    """Values (b, ROWS) of the intervals as (count,) at the samples between them; the last ones repeat."""
    flat = np.asarray(values).ravel()
    middle = np.concatenate([flat[:1], 0.5 * (flat[1:] + flat[:-1])])
    return np.append(middle, np.full(count - len(middle), middle[-1]))


def usual(effect, view):
    """{coefficient: value} of the effect's formula: its first coefficient, with the sign that the plant takes."""
    keys = list(effect.core(view))
    target = min(FLOORS * effect.floor(NOMINAL), SHARE * effect.ceiling(NOMINAL))
    unit = effect.size({key: float(n == 0) for n, key in enumerate(keys)}, NOMINAL)
    for sign in (1.0, -1.0):
        c = {key: sign * target / unit * (n == 0) for n, key in enumerate(keys)}
        values = [v for v in effect.plant(c, NOMINAL).values() if isinstance(v, float)]
        if all(v >= 0.0 for v in values) and (not values or any(values)):
            return c
    raise AssertionError(f"{effect.name}: the plant takes neither sign")


def with_effect(effect):
    """A Recording of the drive with the effect at its usual size."""
    table, view = healthy()
    table, count = dict(table), len(table["t"])
    c, columns_of = usual(effect, view), effect.core(view)
    total = {
        channel: sum(
            c[key] * column.get(channel, 0.0) + np.zeros((len(view), ROWS)) for key, column in columns_of.items()
        )
        for channel in ("u", "torque")
    }
    needed = (total["u"] * np.exp(1j * view.theta_mid)).ravel()
    delay = NOMINAL.control.duty_applied_after_samples
    duty = np.zeros(count, complex)
    duty[: len(needed) - delay] = needed[delay:]  # the duties of a row act this many periods later
    for k, x in enumerate("abc"):
        table[f"d_{x}"] = table[f"d_{x}"] + (duty * TURNS[k]).real / table["u_dc"]
    if not isinstance(effect, Drift):  # only a drift needs a machine that warms up
        del table["temp_winding"]
    torque = table.pop("torque") + at_samples(total["torque"], count)
    if isinstance(effect, ShaftTorque):
        table["torque"] = torque
    return from_columns(table, T, effect.name)
