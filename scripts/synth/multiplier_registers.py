"""Moves flip-flops around an ECP5 multiplier into it, where they are what its own registers do.

A MULT18X18D has registers at A, B and P.  yosys uses the like for Xilinx, not for ECP5: there every multiplication
then runs from flip-flop to flip-flop through 3.9 ns of multiplier and twice the routing.  This pass edits the mapped
netlist (yosys' JSON) before place and route.

The operands' registers move in if each bit of both is 0 or comes from a flip-flop, all of an operand with the same
clock and enable, none with reset or initial 1; the flip-flops stay where something else reads them too.  One operand
alone does not: nextpnr then times the multiplier as if neither had a register.  Nor does one behind more than a LUT:
a flip-flop stands beside its LUT, a multiplier does not, and with its product's register the way from a flip-flop
through it is the shorter one.  The product's moves in if each used bit goes to one such flip-flop and nowhere else.
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass

BITS = {"A": 18, "B": 18, "P": 36}
LOGIC = {"LUT4": 1, "PFUMX": 0, "L6MUX21": 0, "CCU2C": 2}  # how many LUTs a cell counts for
PLACES = {"A": ("INPUTA", 0), "B": ("INPUTB", 1), "P": ("OUTPUT", 2)}  # (parameter's name, number of its CE)


@dataclass(frozen=True)
class Control:
    """What the bits of one register must share: net numbers; ``enable`` None = always on."""

    clock: int
    enable: int | None


def control_of(cell: dict) -> Control | None:
    """The control of a plain rising-edge D flip-flop without reset that starts at 0; None for any other."""
    parameters, nets = cell["parameters"], cell["connections"]
    plain = parameters.get("REGSET") == "RESET" and parameters.get("CLKMUX") == "CLK"
    if cell["type"] != "TRELLIS_FF" or not plain or nets.get("LSR", ["0"]) != ["0"] or "DI" not in nets:
        return None
    mux = parameters.get("CEMUX", "1").strip()
    if mux not in ("1", "CE"):
        return None
    return Control(nets["CLK"][0], nets["CE"][0] if mux == "CE" else None)


class Nets:
    """Who drives a bit, and who reads it; ``free`` is the first number no bit has."""

    def __init__(self, module: dict):
        self.flip_flop: dict[int, str] = {}  # by the bit at Q
        self.driver: dict[int, str] = {}
        self.readers: dict[int, list[tuple[str, str]]] = defaultdict(list)  # bit: (cell, port)
        for name, cell in module["cells"].items():
            for port, bits in cell["connections"].items():
                for bit in bits:
                    if cell["port_directions"][port] == "output":
                        self.driver[bit] = name
                        if cell["type"] == "TRELLIS_FF":
                            self.flip_flop[bit] = name
                    elif not isinstance(bit, str):
                        self.readers[bit].append((name, port))
        for port in module["ports"].values():
            for bit in port["bits"] if port["direction"] == "output" else ():
                self.readers[bit].append(("", "pad"))
        self.free = 1 + max([2, *self.driver, *self.readers], key=lambda bit: -1 if isinstance(bit, str) else bit)


def merge_twins(module: dict) -> int:
    """Makes one of flip-flops that are the same at every clock, and says how many went: two bits of a register that
    hold one sign would keep the product's register outside."""
    first: dict[str, int] = {}
    same: dict[int, int] = {}
    for name, cell in list(module["cells"].items()):
        if cell["type"] != "TRELLIS_FF" or cell.get("attributes", {}).get("keep") or "DI" not in cell["connections"]:
            continue
        inputs = {port: bits for port, bits in cell["connections"].items() if port != "Q"}
        (bit,) = cell["connections"]["Q"]
        kept = first.setdefault(json.dumps([cell["parameters"], inputs], sort_keys=True), bit)
        if kept != bit:
            same[bit] = kept
            del module["cells"][name]
    wired = [cell["connections"] for cell in module["cells"].values()]
    for connections in wired:
        connections.update({port: [same.get(b, b) for b in bits] for port, bits in connections.items()})
    for named in (*module["ports"].values(), *module.get("netnames", {}).values()):
        named["bits"] = [same.get(b, b) for b in named["bits"]]
    return len(same)


def absorb(netlist: dict, top: str) -> dict[str, int]:
    """Changes ``netlist`` in place; {"A", "B", "P"}: how many multipliers got that register, "removed": FFs."""
    module = netlist["modules"][top]
    cells = module["cells"]
    nets = Nets(module)
    done = dict.fromkeys((*BITS, "removed"), 0)
    names = {id(cell): name for name, cell in cells.items()}
    multipliers = [cell for cell in cells.values() if cell["type"] == "MULT18X18D"]
    for cell in multipliers:
        if "REG_OUTPUT_CLK" in cell["parameters"]:
            done["P"] += 1
        elif product := _product(cell, cells, nets):
            control, behind = product
            for pin, bit in behind.items():
                ((name, _),) = nets.readers.pop(cell["connections"][pin][0])
                del cells[name], nets.flip_flop[bit]
                done["removed"] += 1
            set_register(cell, "P", control, behind)
            done["P"] += 1
        operands = [_operand(cell, side, cells, nets) for side in ("A", "B")]
        if all(operands):
            for side, (control, before) in zip(("A", "B"), operands, strict=True):
                for pin, bit in before.items():
                    nets.readers[cell["connections"][pin][0]].remove((names[id(cell)], pin))
                    nets.readers[bit].append((names[id(cell)], pin))
                set_register(cell, side, control, before)
                done[side] += 1
    # What only fed multipliers has no reader left.
    for bit, name in nets.flip_flop.items():
        if not nets.readers[bit]:
            del cells[name]
            done["removed"] += 1
    return done


def shallow(bit, cells: dict, nets: Nets, luts: int = 1) -> bool:
    """Whether ``bit`` is made by registers and at most ``luts`` LUTs one after the other."""
    cell = cells.get(nets.driver.get(bit), {"type": "input"})
    if cell["type"] not in LOGIC:
        return True
    left = luts - LOGIC[cell["type"]]
    directions = cell["port_directions"]
    inputs = (b for port, bits in cell["connections"].items() if directions[port] == "input" for b in bits)
    return left >= 0 and all(shallow(b, cells, nets, left) for b in inputs)


def _operand(cell: dict, side: str, cells: dict, nets: Nets):
    """(control, the bits in front of the flip-flops) of operand A or B, or None."""
    pins = [cell["connections"][f"{side}{n}"][0] for n in range(BITS[side])]
    moved, controls = {}, set()
    for n, bit in enumerate(pins):
        if bit == "0":
            continue
        name = nets.flip_flop.get(bit)
        control = control_of(cells[name]) if name else None
        if control is None:
            return None
        controls.add(control)
        moved[f"{side}{n}"] = cells[name]["connections"]["DI"][0]
    if not all(shallow(bit, cells, nets) for bit in moved.values()):
        return None
    return (controls.pop(), moved) if len(controls) == 1 else None


def _product(cell: dict, cells: dict, nets: Nets):
    """(control, the bits behind the flip-flops) of the product, or None."""
    moved, controls = {}, set()
    for n in range(BITS["P"]):
        (bit,) = cell["connections"].get(f"P{n}", [None])
        readers = nets.readers.get(bit, [])
        if not readers:
            continue
        name, port = readers[0]
        if len(readers) > 1 or port != "DI":
            return None
        control = control_of(cells[name])
        if control is None:
            return None
        controls.add(control)
        moved[f"P{n}"] = cells[name]["connections"]["Q"][0]
    return (controls.pop(), moved) if len(controls) == 1 else None


def set_register(cell: dict, side: str, control: Control, bits: dict[str, int]) -> None:
    """Connects ``bits`` and switches the register on."""
    place, number = PLACES[side]
    cell["port_directions"].update({f"{pin}{n}": "input" for pin in ("CLK", "CE", "RST") for n in range(4)})
    cell["connections"].update({pin: [bit] for pin, bit in bits.items()})
    cell["connections"]["CLK0"] = [control.clock]
    cell["connections"][f"CE{number}"] = ["1" if control.enable is None else control.enable]
    cell["connections"]["RST0"] = ["0"]
    cell["parameters"].update(
        {f"REG_{place}_CLK": "CLK0", f"REG_{place}_CE": f"CE{number}", f"REG_{place}_RST": "RST0"}
    )
    cell["parameters"]["RESETMODE"] = "SYNC"
