# SPDX-License-Identifier: BSD-3-Clause
"""A picture of the motor in the FPGA, build/studies/hil.png: beside the plant, and the residual at a fault."""

from __future__ import annotations

import numpy as np

from fluxproof.checkout import BUILD
from golden_model.estimators.motor_residual import LEAST
from studies.hil.beside_plant import OWN, beside_plant
from studies.hil.drive import RATED_A, ride, servo
from studies.hil.residual import FAULTS, drive_of, limit_v, operating_point, steady

OUT = BUILD / "studies" / "hil.png"
SECONDS = 0.4


def figures(_options) -> list[dict]:
    """Draws; it has no figure."""
    from matplotlib import pyplot

    motor = servo()
    both = beside_plant(motor, ride(motor, SECONDS), OWN)
    ms = 1000 * motor.period_s * np.arange(len(both.plant))
    drive, fault = drive_of("servo_24v"), FAULTS[0]
    found = steady(drive, fault)[0].observed
    mean = np.hypot(*(found[f"residual_mean_{x}"] for x in "dq")) * 2.0**-LEAST.frac_bits * drive.bases.flux_wb
    volts, t = mean / drive.sample_time_s, 1000 * drive.sample_time_s * np.arange(len(mean))
    flag = np.flatnonzero(found["motor_differs"])

    figure, axes = pyplot.subplots(3, 1, figsize=(9, 7.5), layout="constrained")
    last = slice(-round(0.06 / motor.period_s), None)
    axes[0].plot(ms[last], both.plant[last, 0], lw=2.5, color="0.75", label="plant, double precision")
    axes[0].plot(ms[last], both.motor[last, 0], lw=0.9, color="C0", label="motor of the FPGA")
    axes[0].set(ylabel="i_a [A]", title="Same ride, a control of its own for each")
    axes[1].plot(ms, 100 * (both.motor[:, 0] - both.plant[:, 0]) / RATED_A, lw=0.5, color="C3")
    axes[1].set(ylabel="difference [% of rated]", xlabel="t [ms]")
    axes[2].plot(t, volts, color="C0", label="mean residual")
    axes[2].axhline(limit_v(drive, *operating_point(drive, fault)), color="0.5", ls=":", label="limit")
    if len(flag):
        axes[2].axvline(t[flag[0]], color="C3", lw=0.9, label=f"motor_differs after {t[flag[0]]:.0f} ms")
    axes[2].set(ylabel="[V]", xlabel="t [ms]", title=f"Beside a real motor: {fault.name}")
    for axis in axes:
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="lower right" if axis is axes[2] else "upper left", fontsize=8)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT, dpi=110)
    pyplot.close(figure)
    print(f"picture: {OUT}")
    return []
