# SPDX-License-Identifier: BSD-3-Clause
"""diagnosis.json against its schema."""

from __future__ import annotations

import json

import pytest

from fluxproof.checkout import ROOT


def schema() -> dict:
    return json.loads((ROOT / "docs/diagnosis.schema.json").read_text())


def failures(data) -> list[str]:
    """Paths of the schema violations of a diagnosis.json."""
    jsonschema = pytest.importorskip("jsonschema")
    return [error.json_path for error in jsonschema.Draft202012Validator(schema()).iter_errors(data)]
