# SPDX-License-Identifier: BSD-3-Clause
"""Recordings from a stranger: formulas that run, links, plugins, and much from few bytes."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import made
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import read_table


def refused(path, *parts):
    """The message of the refusal, in which all ``parts`` occur."""
    with pytest.raises(RecordingError) as error:
        read_table(path)
    message = str(error.value)
    assert message.isprintable() and len(message) < 400
    assert all(part in message for part in parts), message
    return message


def planting(marker: Path, variable: str) -> str:
    """A formula that passes numexpr's filter, which leaves out quoted text, and makes the file ``marker``."""
    return f'{variable}+len(f\'{{(lambda:open("{marker}","w").close())()}}\')*0'


def mdf(path: Path, conversion, *, on="u_dc", version="4.10", **more):
    """The made recording as MDF with a conversion (asammdf's block) of channel ``on``, "time" being the master."""
    from asammdf import MDF, Signal

    table = made(800) | more
    with MDF(version=version) as file:
        file.append([Signal(v.astype(float), table["t"], name=n, unit="") for n, v in table.items() if n != "t"])
        channels = {c.name: c for c in file.groups[0].channels}
        channels[on].conversion = conversion
        return file.save(path, overwrite=True)


def formula(text: str, version="4.10"):
    """The conversion block of a formula."""
    from asammdf.blocks import v2_v3_blocks, v4_blocks

    if version < "4":
        return v2_v3_blocks.ChannelConversion(conversion_type=10, formula=text)
    return v4_blocks.ChannelConversion(conversion_type=3, formula=text)


def hdf5(path: Path, build, leave_out=("i_a",)):
    """The made recording without some columns as HDF5, and what ``build(file)`` adds."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in made(800).items():
            if name not in leave_out:
                file[name] = values
        build(file)
    return path


def mat73(path: Path, build):
    """The same as a MATLAB 7.3 file: HDF5 behind 512 bytes."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in made(800).items():
            file[name] = values[None, :]
        build(file)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def constant_npz(path: Path, columns, rows: int):
    """Columns of zeros, each packed to a thousandth."""
    block = bytes(8 * 125_000)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in columns:
            head = io.BytesIO()
            header = {"descr": "<f8", "fortran_order": False, "shape": (rows,)}
            np.lib.format.write_array_header_1_0(head, header)
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(head.getvalue())
                for _ in range(rows // 125_000):
                    member.write(block)
    return path


def constant_parquet(path: Path, columns, rows: int):
    """Columns of ones, run-length coded to a few bytes a page."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    one = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int8)), pa.array([1.0])).cast(pa.float64())
    pq.write_table(pa.table({name: one for name in columns}), path, data_page_size=1 << 24, compression="zstd")
    return path


def with_extension(path: Path):
    """A Parquet file whose Arrow schema names the extension type that old versions of pyarrow unpickled."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64()) for name in made(4) if name != "u_dc"]
    metadata = {
        "ARROW:extension:name": "arrow.py_extension_type",
        "ARROW:extension:metadata": b"cos\nsystem\n(S'false'\ntR.",
    }
    fields.append(pa.field("u_dc", pa.float64(), metadata=metadata))
    table = made(800)
    pq.write_table(pa.table([table[f.name] for f in fields], schema=pa.schema(fields)), path)
    return path
