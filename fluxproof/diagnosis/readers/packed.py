# SPDX-License-Identifier: BSD-3-Clause
"""Files that benches keep their tables in and that no reader opens: what to do with each is told at once."""

from __future__ import annotations

from fluxproof.diagnosis.ground.recording import RecordingError

PACKED = {  # first bytes: what the file is, and what to do
    b"\xd0\xcf\x11\xe0": "an old Excel workbook: save the sheet as CSV",
    b"\x1f\x8b": "compressed by gzip: unpack it",
    b"TDSm": "TDMS of LabVIEW: export it as CSV",
    b"\x89PNG": "a picture: a recording is a table of numbers",
}
ARCHIVE = b"PK\x03\x04"  # of NumPy too
WHAT = "a ZIP archive or an Excel workbook: unpack it, or save the sheet as CSV"


def refuse_packed(path, head: bytes) -> None:
    """RecordingError for a file that has to be unpacked or exported first."""
    what = next((text for magic, text in PACKED.items() if head.startswith(magic)), "")
    if head.startswith(ARCHIVE) and path.suffix.lower() in (".xlsx", ".xlsm", ".ods", ".zip"):
        what = WHAT
    if what:
        raise RecordingError(f"{path}: {what}")
