"""Builds an entity with GHDL and runs a cocotb module on it; the one place that talks to the simulator."""

from __future__ import annotations

import contextlib
import hashlib
import os
import subprocess
from pathlib import Path
from xml.etree import ElementTree

from cocotb_tools.runner import get_runner

ROOT = Path(__file__).resolve().parent.parent
RTL = ROOT / "rtl"


class BuildError(RuntimeError):
    """VHDL that does not analyse or elaborate."""


def run_folder(toplevel: str, generics: dict, rtl: Path = RTL, key: str = "") -> Path:
    """Where ``run`` works and leaves its files; different for whatever may run at the same time."""
    tag = hashlib.sha256(repr((str(rtl), sorted(generics.items()), key)).encode()).hexdigest()[:8]
    return ROOT / "build" / "sim" / f"{toplevel}-{tag}"


def run(
    toplevel: str, module: str, generics: dict, environment: dict, rtl: Path = RTL, key: str = "", extra=()
) -> Path:
    """Simulate ``toplevel`` under cocotb module ``module``; returns the folder of the run, see failure().

    ``rtl`` may be another tree (a mutant's), ``extra`` files beside it (a test's own top).  Raises BuildError with
    GHDL's words where the VHDL does not build.
    """
    folder = run_folder(toplevel, generics, rtl, key)
    build(toplevel, folder, rtl, extra)
    return execute(toplevel, module, generics, environment, folder)


def build(toplevel: str, folder: Path, rtl: Path = RTL, extra=()) -> None:
    """Analyse and elaborate in ``folder``, for any generics; BuildError with GHDL's words where it does not build."""
    sources = [*sorted(rtl.rglob("*.vhd")), *extra]
    runner = get_runner("ghdl")
    try:
        runner.build(
            sources=sources,
            hdl_toplevel=toplevel,
            build_args=["--std=08"],
            build_dir=folder,
            always=True,
            log_file=_log(folder, "build.log"),
        )
    except (SystemExit, RuntimeError, subprocess.CalledProcessError) as error:
        words = (folder / "build.log").read_text().splitlines() if (folder / "build.log").exists() else []
        told = [line for line in words if "error" in line or ".vhd:" in line] or words
        raise BuildError(f"{toplevel} does not build: " + "\n".join(told[-12:] or [str(error)])) from error


def execute(toplevel: str, module: str, generics: dict, environment: dict, folder: Path) -> Path:
    """Simulate what ``build`` has left in ``folder`` with these generics; returns ``folder``, see failure()."""
    (folder / "results.xml").unlink(missing_ok=True)
    # GHDL's warnings about metavalues at time zero say nothing; the bench checks for metavalues itself.
    command = dict(
        hdl_toplevel=toplevel,
        hdl_toplevel_lang="vhdl",
        test_module=module,
        parameters=generics,
        build_dir=folder,
        test_dir=folder,
        test_args=["--std=08"],
        plusargs=["--ieee-asserts=disable"],
        extra_env={**environment, "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
        log_file=_log(folder, "test.log"),
        results_xml=str(folder / "results.xml"),
    )
    with contextlib.suppress(SystemExit):  # how the runner says that a test failed: the caller asks failure()
        get_runner("ghdl").test(**command)
    return folder


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
