# SPDX-License-Identifier: BSD-3-Clause
"""Write diagnosis.json (docs/diagnosis.schema.json) and report.html.

Both texts are complete before the first file is written; each file is written to a temporary name and renamed.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.report import page
from fluxproof.files import write_json, write_text

# Keys whose number may be unknown or unbounded (null in the schema).  NaN under any other key is a defect of the tool.
MAY_BE_NULL = frozenset(
    ("sigma", "amplitude", "low", "high", "rms", "rms_elsewhere")
    + ("train_before", "train_after", "holdout_before", "holdout_after", "noise_floor")
    + ("u_dc", "temp_winding")
)


def write_outputs(diagnosis, out_dir, nominal=None, overlay: dict | None = None) -> list[Path]:
    """Write ``out_dir``/diagnosis.json and ``out_dir``/report.html; returns their paths.

    diagnosis: diagnosis.result.Diagnosis.
    nominal: diagnosis.nominal.Nominal or None; it gives the nominal values and the speed in rpm.
    overlay: the closed-loop simulation laid over the recording, or None: {"t": (n,) s, "recorded": {column: (n,)},
        "simulated_before": {column: (n,)}, "simulated_after": {column: (n,)}} with canonical columns, SI units;
        each of the simulated ones may be absent.

    Raises ValueError if a number that must be finite is not, OSError if the folder
    cannot be written.
    """
    data = json_ready(diagnosis.to_json())
    html = page.render(diagnosis, nominal=nominal, overlay=overlay)
    out_dir = Path(out_dir)
    return [write_json(out_dir / "diagnosis.json", data), write_text(out_dir / "report.html", html)]


def json_ready(value, path: str = "diagnosis"):
    """``value`` with NumPy types converted to Python types; NaN and infinity become None for keys in ``MAY_BE_NULL``.

    Raises ValueError with the path of any other number that is not finite.
    """
    if isinstance(value, dict):
        return {str(key): json_ready(item, f"{path}.{key}") for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [json_ready(item, f"{path}[{k}]") for k, item in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        if path.rsplit(".", 1)[-1] in MAY_BE_NULL:
            return None
        raise ValueError(f"{path} is {value}: a finite number is needed here")
    return value
