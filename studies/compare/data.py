# SPDX-License-Identifier: BSD-3-Clause
"""The data of a case for every method: the nominal drive's misfit in steady blocks and the signals that may explain it.

    u      u_recorded - R mean(i) - [psi(i+, theta+) - psi(i, theta)] / T in dq, complex (b, m) [V]
    sum    i_a + i_b + i_c, if three currents were measured, (b, m) [A]
    torque shaft torque minus that of the nominal drive, if a transducer was recorded, (b, m) [Nm]

Every fourth operating point is held out, the same ones for every method.  The measure of a model is the rms of its
residual block means of u (200 rows each) over these held-out blocks.  The noise floor comes from consecutive blocks at
one operating point, which share all physics.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.holdout import holdout_blocks
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording


@dataclass
class Data:
    """view: diagnosis.view.View of b blocks of m rows; misfit: {channel: (b, m)}; held: bool (b,)."""

    view: object
    misfit: dict[str, np.ndarray]
    held: np.ndarray
    memo: dict = field(default_factory=dict, repr=False)  # of dictionary.equations

    def fitted(self, channel: str) -> np.ndarray:
        """Indices of the blocks that a fit may use; the torque of a block in a ramp is nan."""
        return np.flatnonzero(~self.held & np.isfinite(self.misfit[channel]).all(axis=1))

    def voltage_change(self) -> np.ndarray:
        """Change of the voltage by one sample of delay, dq (b, m) [V].

        It uses the nominal drive's voltage, since the recorded one depends on the current noise, which is also in the
        misfit.
        """
        v = self.view
        needed = v.machine.resistance_ohm * v.i_mid + v.flux(v.nominal_psi)
        return needed * (1.0 - np.exp(-1j * v.omega_mid * v.sample_time_s))

    @property
    def units(self) -> dict[str, float]:
        """One per mille of the bus [V], of the rated current [A], of the rated torque [Nm]."""
        n, m = self.view.nominal, self.view.machine
        torque = 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a
        return {"u": 1e-3 * n.inverter.dc_bus_v, "sum": 1e-3 * m.rated_current_a, "torque": 1e-3 * torque}


def recording_of(folder: Path) -> Path:
    """The recording in a case's folder."""
    return next(path for path in sorted(folder.iterdir()) if path.stem == "recording")


def load(folder: Path) -> Data:
    """Read, check and balance the case in ``folder``; RecordingError if the recording is unusable."""
    nominal = load_nominal(folder / "drive.toml")
    recording = load_recording(recording_of(folder), nominal)
    if recording.fatal:
        raise RecordingError(f"{recording.source}: unusable: {recording.problems[0].message}")
    view = view_of(recording, nominal, CATALOGUE)
    whole = np.isfinite(view.u).all(axis=1) & np.isfinite(view.u_dc).all(axis=1)
    view = view.take(whole)
    channels = misfit(view)
    if "torque" in channels and not (view.shaft == "torque").all():
        del channels["torque"]  # without a transducer the load is unknown
    return Data(view, channels, holdout_blocks(view))


def averaged(x: np.ndarray, rows: int) -> np.ndarray:
    """Means of ``rows`` neighbours within each block, (b, m, ...) to (b, m // rows, ...).

    The balance telescopes: the mean of a flux difference keeps the noise of two samples only.
    """
    b, m = x.shape[:2]
    return x[:, : m // rows * rows].reshape(b, m // rows, rows, *x.shape[2:]).mean(axis=2)


def holdout_rms(left: np.ndarray, held: np.ndarray) -> float:
    """rms over held-out blocks of a model's residual block means ``left``, complex (b,) [V]."""
    return float(np.sqrt(np.mean(np.abs(left[held]) ** 2)))


def neighbour_rms(left: np.ndarray, run: np.ndarray) -> float:
    """Noise of one block mean [V], from the differences between neighbouring blocks of a dwell; nan without any."""
    pair = np.flatnonzero((np.diff(run) == 0) & np.isfinite(left[1:] - left[:-1]))
    if not len(pair):
        return float("nan")
    return float(np.sqrt(0.5 * np.mean(np.abs(left[pair + 1] - left[pair]) ** 2)))
