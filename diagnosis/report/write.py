"""Writing a diagnosis: diagnosis.json (docs/diagnosis.schema.json) and report.html, both or neither begun.

Both texts are made before the first is written, and each is written to a temporary name and renamed.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.report import page
from fluxproof.files import write_json, write_text

# Keys whose number may be unknown or open-ended; null in the schema too.  Elsewhere NaN is a fault of ours.
MAY_BE_NULL = frozenset(
    ("sigma", "amplitude", "low", "high", "rms", "rms_elsewhere")
    + ("train_before", "train_after", "holdout_before", "holdout_after", "noise_floor")
    + ("u_dc", "temp_winding")
)


def write_outputs(diagnosis, out_dir, nominal=None, overlay: dict | None = None) -> list[Path]:
    """Write ``out_dir``/diagnosis.json and ``out_dir``/report.html; returns their paths.

    diagnosis: diagnosis.result.Diagnosis.
    nominal: diagnosis.nominal.Nominal, for the values before beside the values after, and for rpm; or None.
    overlay: the closed-loop simulation laid over the recording, or None: {"t": (n,) s, "recorded": {column: (n,)},
        "simulated_before": {column: (n,)}, "simulated_after": {column: (n,)}} with canonical columns, SI units;
        each of the simulated ones may be absent.

    Raises ValueError where the diagnosis holds a number that is not finite and must be, OSError where the folder
    cannot be written.
    """
    data = json_ready(diagnosis.to_json())
    html = page.render(diagnosis, nominal=nominal, overlay=overlay)
    out_dir = Path(out_dir)
    return [write_json(out_dir / "diagnosis.json", data), write_text(out_dir / "report.html", html)]


def json_ready(value, path: str = "diagnosis"):
    """``value`` with NumPy turned into plain Python, and NaN or infinity into None where ``MAY_BE_NULL`` has the key.

    Raises ValueError that names the place of any other number that is not finite.
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
