# SPDX-License-Identifier: BSD-3-Clause
"""Builds an entity with GHDL and runs a cocotb module on it; the one place that talks to the simulator."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import time
from pathlib import Path
from xml.etree import ElementTree

from cocotb_tools.runner import get_runner

from fluxproof.checkout import BUILD, ROOT, RTL
from fluxproof.cosim.flat import flat_top
from fluxproof.cosim.sources import closure

KEPT_S = 24 * 3600.0  # builds of older sources that were not used for so long are deleted


class BuildError(RuntimeError):
    """VHDL that does not analyse or elaborate."""


def run_folder(toplevel: str, generics: dict, rtl: Path = RTL, key: str = "") -> Path:
    """Where ``run`` works and leaves its files; different for whatever may run at the same time."""
    tag = hashlib.sha256(repr((str(rtl), sorted(generics.items()), key)).encode()).hexdigest()[:8]
    return BUILD / "sim" / f"{toplevel}-{tag}"


def build(toplevel: str, rtl: Path = RTL, extra=()) -> Path:
    """Analyse and elaborate ``toplevel`` once per state of the VHDL; the folder it is in.

    All tops of a state share a library, in which GHDL analyses a file for the first top that needs it.  An entity with
    records as ports is built inside a flat top (cosim/flat.py).  Generics are set when the simulation starts, so all
    configurations share a build, and so do processes that run at the same time.  Raises BuildError with GHDL's words
    where the VHDL does not build.
    """
    toplevel, around = flat_top(toplevel, rtl, extra)
    closure(toplevel, rtl, [*extra, *around])  # raises ValueError where a file is missing or declared twice
    sources = [*sorted(rtl.rglob("*.vhd")), *extra]
    state = hashlib.sha256(os.environ.get("GHDL_BACKEND", "").encode())
    for path in sources:
        state.update(f"{path}\n".encode() + path.read_bytes())
    # A copy of the RTL, such as a planted defect's, keeps its builds and takes them along when it is deleted.
    builds = BUILD / "ghdl" if rtl == ROOT / "rtl" else rtl / ".ghdl"
    folder = builds / state.hexdigest()[:16]
    builds.mkdir(parents=True, exist_ok=True)
    with open(builds / f"{folder.name}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for old in builds.iterdir():
            if old.is_dir() and old != folder and time.time() - old.stat().st_mtime > KEPT_S:
                shutil.rmtree(old)
        if not (folder / "files").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            _ghdl("-i", folder, toplevel, sources)
            (folder / "files").touch()
        os.utime(folder)
        built = folder / f"{toplevel}.built"
        if not built.exists():
            if around:
                _ghdl("-i", folder, toplevel, around)
            _ghdl("-m", folder, toplevel, [toplevel])
            built.touch()
    return folder


def _ghdl(what: str, folder: Path, toplevel: str, rest) -> None:
    """One of GHDL's commands on a library; BuildError with its words."""
    command = ["ghdl", what, "--std=08", "--work=top", f"--workdir={folder}", *map(str, rest)]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    except FileNotFoundError:
        raise BuildError(f"{toplevel} does not build: ghdl is not installed (make setup)") from None
    (folder / f"{toplevel}.log").write_text(done.stdout + done.stderr)
    if done.returncode:
        words = (done.stdout + done.stderr).splitlines()
        errors = [line for line in words if "error" in line or ".vhd:" in line] or words
        raise BuildError(f"{toplevel} does not build: " + "\n".join(errors[-12:]))


def run(
    toplevel: str, module: str, generics: dict, environment: dict, rtl: Path = RTL, key: str = "", extra=()
) -> Path:
    """Simulate ``toplevel`` under cocotb module ``module``; returns the folder of the run, see failure().

    ``rtl`` may be another tree (a mutant's), ``extra`` additional files (a test's own top).  Raises BuildError, see
    build().
    """
    folder = run_folder(toplevel, generics, rtl, key)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "results.xml").unlink(missing_ok=True)
    built = build(toplevel, rtl, extra)
    toplevel, _ = flat_top(toplevel, rtl, extra)
    # `ghdl -r` starts the program of this name in the folder it runs in; mcode, which makes none, reads the library.
    (folder / toplevel).unlink(missing_ok=True)
    if (built / toplevel).exists():
        (folder / toplevel).symlink_to(built / toplevel)
    # GHDL's warnings about metavalues at time zero say nothing; the bench checks for metavalues itself.
    with contextlib.suppress(SystemExit):  # how the runner says that a test failed: the caller asks failure()
        get_runner("ghdl").test(
            hdl_toplevel=toplevel,
            hdl_toplevel_lang="vhdl",
            hdl_toplevel_library="top",
            test_module=module,
            parameters=generics,
            build_dir=built,
            test_dir=folder,
            test_args=["--std=08", f"--workdir={built}"],
            plusargs=["--ieee-asserts=disable", *waves(folder)],
            extra_env={
                "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
                # Else pytest recompiles all that is imported (numba, scipy) to explain asserts: seconds in every run.
                "COCOTB_REWRITE_ASSERTION_FILES": "dut_*.py",
                **environment,
            },
            log_file=_log(folder, "test.log"),
            results_xml=str(folder / "results.xml"),
        )
    return folder


def waves(folder: Path) -> list[str]:
    """GHDL's option for the waveform of a run where FLUXPROOF_WAVES is set; only FST takes every top.

    The path is absolute: a simulator works in a folder of its own.
    """
    return [f"--fst={folder.resolve() / 'waves.fst'}"] if os.environ.get("FLUXPROOF_WAVES") else []


def _log(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder / name


def failure(folder: Path) -> str | None:
    """The message of the first failed test of a run, or None."""
    path = folder / "results.xml"
    if not path.exists():
        return f"the simulation wrote no result; see {folder.name}/test.log"
    for case in ElementTree.parse(path).iter("testcase"):
        for kind in ("failure", "error"):
            found = case.find(kind)
            if found is not None:
                return (found.get("error_msg") or found.get("message") or "") + (found.text or "")
    return None
