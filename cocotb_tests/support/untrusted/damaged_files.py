# SPDX-License-Identifier: BSD-3-Clause
"""Makes several hundred damaged and hostile recordings of every format, with the allowed outcomes of each."""

from __future__ import annotations

import io
import os
import pickle
import struct
import zipfile
import zlib

import numpy as np

from cocotb_tests.support.recordings.from_equations import as_text, dump, made, write, write_mat73

SUFFIXES = (".csv", ".parquet", ".npz", ".npy", ".h5", ".mat", ".mf4")
REFUSED = "refused"  # nothing may be made of it
EITHER = "either"  # refused, or loaded with everything finite


class Canary:
    """An object whose pickle, were it loaded, would leave a file behind."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return open, (self.path, "w")


def damaged_files(folder) -> dict[str, tuple[object, str]]:
    """{name: (path, REFUSED or EITHER)} of damaged files, written into ``folder``."""
    files = changed_files(folder)
    add = _into(folder, files)
    _texts(add)
    _values(add)
    _hostile(add, folder, files)
    return files


def changed_files(folder) -> dict[str, tuple[object, str]]:
    """Those of them that were a recording: cut, changed, or under another format's name."""
    files, whole = {}, {suffix: write(folder / f"whole{suffix}", made(800)).read_bytes() for suffix in SUFFIXES}
    whole["73.mat"] = write_mat73(folder / "whole73.mat", made(800)).read_bytes()
    whole[".dump"] = dump(folder / "whole.dump")[0].read_bytes()
    add = _into(folder, files)
    _cut_and_flipped(add, whole)
    _wrong_names(add, whole)
    return files


def _into(folder, files):
    """A function that writes a file to ``folder`` and enters it in ``files``."""

    def add(name, content, expected=EITHER):
        path = folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        files[name] = path, expected

    return add


def _cut_and_flipped(add, whole) -> None:
    """Truncated at many points, bytes changed at many points, heads overwritten."""
    rng = np.random.default_rng(5)
    for suffix, content in whole.items():
        tail = "." + suffix.split(".")[-1]
        n = len(content)
        binary = suffix != ".csv"
        for k, at in enumerate([1, 7, 8, 63, 127, 128, 300, 600, n // 4, n // 2, 3 * n // 4, n - 200, n - 9, n - 1]):
            # What is cut in its first half holds too few rows at best.
            add(f"cut{k}_{suffix[:2]}{tail}", content[:at], REFUSED if at < 600 else EITHER)
        for k in range(10):
            changed = bytearray(content)
            for at in rng.integers(0, n, 1 + 4 * k):
                changed[at] ^= 1 << int(rng.integers(8))
            add(f"flip{k}_{suffix[:2]}{tail}", bytes(changed))
        for k in range(4):  # where the structure is, not the numbers
            changed = bytearray(content)
            changed[8 + 24 * k : 24 + 24 * k] = rng.bytes(16)
            add(f"head{k}_{suffix[:2]}{tail}", bytes(changed))
        add(f"zeros_{suffix[:2]}{tail}", bytes(len(content)), REFUSED)
        add(f"random_{suffix[:2]}{tail}", rng.bytes(5000), REFUSED)
        add(f"empty_{suffix[:2]}{tail}", b"", REFUSED)
        add(f"magic_{suffix[:2]}{tail}", content[:16], REFUSED)
        if binary:
            add(f"middle_{suffix[:2]}{tail}", content[: n // 3] + bytes(n // 3) + content[2 * n // 3 :])
            add(f"tail_{suffix[:2]}{tail}", content + rng.bytes(3000))


def _wrong_names(add, whole) -> None:
    """Every format under the name of every other."""
    for suffix, content in whole.items():
        for claim in SUFFIXES:
            if claim != "." + suffix.split(".")[-1] and {suffix, claim} != {".npz", ".npy"}:
                add(f"is_{suffix[-3:].strip('.')}_{suffix[:2].strip('.')}_named{claim}", content, REFUSED)
    add("picture.csv", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + bytes(100), REFUSED)
    add("program.csv", b"\x7fELF\x02\x01\x01" + bytes(200), REFUSED)
    add("page.csv", "<!DOCTYPE html><html><body><h1>404 Not Found</h1></body></html>\n", REFUSED)
    add("object.csv", '{"t": [0, 1, 2], "i_a": [0, 1, 2]}\n', REFUSED)
    add("archive.npz", _zip({"readme.txt": b"hello"}), REFUSED)
    add("sheet.csv", _zip({"xl/workbook.xml": b"<x/>", "[Content_Types].xml": b"<x/>"}), REFUSED)
    add("without_suffix", b"\x00\x01\x02\x03" * 99, REFUSED)
    add("zipped.csv.gz", zlib.compress(b"t,i_a\n0,0\n"), REFUSED)


def _zip(members) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return out.getvalue()


def _texts(add) -> None:
    """Text that is no table, or a broken one."""
    table = made(800)
    text = as_text(table, ",", ".")
    lines = text.split("\n")
    header = lines[0]
    add("header_only.csv", header + "\n", REFUSED)
    add("header_without_end.csv", header, REFUSED)
    add("blank.csv", "\n\n\n   \n", REFUSED)
    add("comments.csv", "# a\n# b\n", REFUSED)
    add("prose.csv", "The quick brown fox\njumps over the lazy dog\n" * 20, REFUSED)
    add("words.csv", header + "\n" + ",".join(["word"] * 10) + "\n", REFUSED)
    add("one_row.csv", "\n".join(lines[:2]) + "\n", REFUSED)
    add("long_row.csv", "\n".join([*lines[:400], lines[400] + ",1,2,3", *lines[401:]]), REFUSED)
    add("short_row.csv", "\n".join([*lines[:400], "1,2", *lines[401:]]))
    add(
        "half_columns.csv",
        "\n".join([header, *(",".join(line.split(",")[:5]) for line in lines[1:-1])]) + "\n",
        REFUSED,
    )
    add("more_columns.csv", "\n".join([header, *(line + ",1,2" for line in lines[1:-1])]) + "\n")
    add("column_twice.csv", text.replace("i_c", "i_b", 1), REFUSED)
    add("zero_bytes.csv", text.encode()[:9000] + bytes(50) + text.encode()[9000:])
    add("control.csv", text.encode()[:9000] + bytes(range(1, 32)) * 9 + text.encode()[9000:])
    add("open_quote.csv", "\n".join([*lines[:400], '"' + lines[400], *lines[401:]]))
    add("quotes.csv", header + "\n" + '"' * 4001 + "\n", REFUSED)
    add("one_line.csv", "1,2,3," * 100_000, REFUSED)
    add("one_wide_line.csv", header + "\n" + "1," * 60_000 + "\n", REFUSED)
    add("wide.csv", ",".join(f"c{k}" for k in range(6000)) + "\n" + (",".join("1" * 6000) + "\n") * 3, REFUSED)
    add("formulas.csv", header + "\n" + '=HYPERLINK("x"),@SUM(A1),+cmd|1,-2,0,0,0,0,0,0\n' * 500, REFUSED)
    add("escape.csv", "t,\x1b[2Ji_a\x07,i_b\n" + "0,1,2\n" * 500, REFUSED)
    add("newline_name.csv", 't,"i\n_a",i_b\n' + "0,1,2\n" * 500, REFUSED)
    add("huge_numbers.csv", header + "\n" + ("9" * 400 + ",1,2,3,4,5,6,7,8,9\n") * 500, REFUSED)
    add(
        "overflow.csv",
        header + "\n" + "".join(f"{k}e-4,1e999,1,1,1,1,1,1,1,1\n" for k in range(800)),
        REFUSED,
    )
    add("dates.csv", header + "\n" + "2026-01-01 10:00:00,1,2,3,4,5,6,7,8,9\n" * 500, REFUSED)
    add("thousands.csv", header + "\n" + '"1,234.5",1,2,3,4,5,6,7,8,9\n' * 500, REFUSED)
    add("latin.csv", text.replace("t,", "tempé,", 1).encode("latin-1"))
    add("utf16_cut.csv", text.encode("utf-16")[:-1])
    add("utf16_odd.csv", b"\xff\xfe" + b"\xd8\x00" * 400, REFUSED)
    add(
        "mixed_separators.csv",
        "\n".join(line.replace(",", ";") if k % 2 else line for k, line in enumerate(lines)),
    )
    add("old_mac.csv", text.replace("\n", "\r"))
    add(
        "every_word.csv",
        "\n".join([header, *(line.replace(",", ",x", 1) for line in lines[1:-1])]) + "\n",
        REFUSED,
    )
    add("no_header.csv", "\n".join(lines[1:]), REFUSED)
    add("other_names.csv", text.replace("i_", "j_"), REFUSED)
    add("bad_unit.csv", text.replace("i_a", "i_a [furlong]", 1), REFUSED)


def _values(add) -> None:
    """Tables that are well formed and wrong; what is fatal comes as a problem, not as an error."""
    n = 800
    nothing, k = np.full(n, np.nan), np.arange(n)
    parts = {"second": k % 2 == 0, "third": k % 3 == 1, "but_one": k > 0, "half": k < n // 2, "last": k == n - 1}
    for name in made(4):
        for what, values in (
            ("nan", nothing),
            ("inf", np.full(n, np.inf)),
            ("zero", np.zeros(n)),
            ("huge", np.full(n, 1e300)),
        ):
            add(f"{what}_{name}.csv", as_text(made(n) | {name: values}, ",", "."))
        for bad in (np.nan, np.inf, 1e300):
            for part, rows in parts.items():
                add(f"{bad}_{part}_{name}.csv", as_text(made(n) | {name: np.where(rows, bad, made(n)[name])}, ",", "."))
        add(f"without_{name}.csv", as_text({k: v for k, v in made(n).items() if k != name}, ",", "."))
    rng = np.random.default_rng(3)
    add("noise.csv", as_text({name: rng.normal(size=n) for name in made(4)}, ",", "."))
    add("constant.csv", as_text({name: np.ones(n) for name in made(4)}, ",", "."))
    add("backwards.csv", as_text({name: v[::-1] for name, v in made(n).items()}, ",", "."))
    add("shuffled.csv", as_text({name: v[rng.permutation(n)] for name, v in made(n).items()}, ",", "."))
    add("epoch_ns.csv", as_text(made(n) | {"t": 1.7e18 + made(n)["t"] * 1e9}, ",", "."))
    add("negative_bus.csv", as_text(made(n) | {"u_dc": -made(n)["u_dc"]}, ",", "."))


def _npy(header: str) -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def _hostile(add, folder, files) -> None:
    """Files that would run code, follow links or fill the memory of a careless reader."""
    import h5py

    canary = Canary(folder / "canary")
    add("pickle.npy", _save(np.array([canary, 1], dtype=object)), REFUSED)
    add("pickle.npz", _zip({"t.npy": _save(np.array([canary], dtype=object))}), REFUSED)
    add("plain_pickle.npy", pickle.dumps(canary), REFUSED)
    add("plain_pickle.csv", pickle.dumps(canary), REFUSED)
    add("huge.npy", _npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 10), }"), REFUSED)
    add("negative.npy", _npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-5, 10), }"), REFUSED)
    add(
        "code.npy",
        _npy("{'descr': __import__('os').abort(), 'fortran_order': False, 'shape': (1,)}"),
        REFUSED,
    )
    add("deep.npy", _npy("(" * 100), REFUSED)
    add(
        "huge.npz",
        _zip({"t.npy": _npy("{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999,), }")}),
        REFUSED,
    )
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("t", "i_a"):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(_npy("{'descr': '<f8', 'fortran_order': False, 'shape': (150000000,), }"))
                for _ in range(1150):
                    member.write(bytes(1 << 20))
    add("bomb.npz", bomb.getvalue(), REFUSED)
    add("path.npz", _zip({"../../evil.npy": _save(np.arange(5.0))}), REFUSED)
    add("cube.npy", _save(np.zeros((9, 9, 9))), REFUSED)
    add("complex.npy", _save(np.zeros((900, 3), complex)), REFUSED)
    _hostile_hdf5(h5py, add, folder, files)
    element = zlib.compress(bytes(1 << 28), 9)
    packed = b"".join(struct.pack("<II", 15, len(element)) + element for _ in range(8))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    add("bomb.mat", head + packed, REFUSED)
    add("sizes.mat", head + struct.pack("<II", 14, 0xFFFFFFF0) + bytes(64), REFUSED)
    add("endless.mat", head + struct.pack("<II", 15, 0), REFUSED)
    add("footer.parquet", b"PAR1" + bytes(100) + struct.pack("<I", 0x7FFFFFFF) + b"PAR1", REFUSED)
    add("footer0.parquet", b"PAR1" + bytes(100) + struct.pack("<I", 0) + b"PAR1", REFUSED)
    add(
        "ring.mf4",
        b"MDF     4.10    test    ".ljust(64, b"\0") + (b"##HD" + bytes(4) + struct.pack("<QQ", 104, 6) + b"@" * 88),
        REFUSED,
    )
    for name, make in {
        "folder.csv": lambda p: p.mkdir(),
        "pipe.csv": os.mkfifo,
        "loop.csv": lambda p: p.symlink_to(p),
        "nowhere.csv": lambda p: p.symlink_to(folder / "none"),
        "device.csv": lambda p: p.symlink_to("/dev/zero"),
    }.items():
        make(folder / name)
        files[name] = folder / name, REFUSED
    files["missing.csv"] = folder / "missing.csv", REFUSED
    files["zero byte in name"] = f"{folder}/a\0b.csv", REFUSED


def _save(array) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=True)
    return out.getvalue()


def _hostile_hdf5(h5py, add, folder, files) -> None:
    def make(name, build, expected=REFUSED):
        path = folder / name
        with h5py.File(path, "w") as file:
            for column, values in made(800).items():
                if column != "i_a":
                    file[column] = values
            build(file)
        files[name] = path, expected
        return path

    other = folder / "other.h5"
    with h5py.File(other, "w") as file:
        file["i_a"] = made(800)["i_a"]
    (folder / "raw").write_bytes(made(800)["i_a"].tobytes())
    layout = h5py.VirtualLayout((800,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "i_a", (800,))
    make("link.h5", lambda f: f.__setitem__("i_a", h5py.ExternalLink(str(other), "i_a")))
    make(
        "deep_link.h5",
        lambda f: f.create_group("g").__setitem__("i_a", h5py.ExternalLink("/etc/passwd", "i_a")),
    )
    make(
        "outside.h5",
        lambda f: f.create_dataset("i_a", (800,), "f8", external=[(str(folder / "raw"), 0, 6400)]),
    )
    make("virtual.h5", lambda f: f.create_virtual_dataset("i_a", layout))
    make("ragged.h5", lambda f: f.create_dataset("i_a", data=np.zeros(700)))
    make("huge.h5", lambda f: f.create_dataset("i_a", (10**13,), "f8", chunks=(1000,)))
    make(
        "chunk.h5",
        lambda f: f.create_dataset("i_a", (2 * 10**8,), "f8", chunks=(2 * 10**8,), compression="gzip"),
    )
    make("words.h5", lambda f: f.create_dataset("i_a", data=np.array([b"a"] * 800)), EITHER)
    make("round.h5", lambda f: f.__setitem__("again", f["/"]), EITHER)
    with h5py.File(folder / "none.h5", "w"):
        files["none.h5"] = folder / "none.h5", REFUSED
    content = make("link_in.h5", lambda f: f.__setitem__("i_a", h5py.ExternalLink(str(other), "i_a"))).read_bytes()
    add("link.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384) + content, REFUSED)
