"""What the passes over a mapped ECP5 netlist (yosys' JSON) share: who drives and reads a bit, what a register is."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass

ADDER = "CCU2C"
CONSTANTS = ("0", "1", "x", "z")
BITS = {"A": 18, "B": 18, "P": 36}  # of a MULT18X18D
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


def placed_module(design: dict) -> dict:
    """The design's own module of what nextpnr wrote; beside it are empty models."""
    return max(design["modules"].values(), key=lambda module: len(module["cells"]))


def outputs(cell: dict) -> list[int]:
    return [
        bit
        for port, bits in cell["connections"].items()
        if cell["port_directions"][port] == "output"
        for bit in bits
    ]


def merge_twins(module: dict) -> int:
    """Makes one of a block's flip-flops that are the same at every clock, and says how many went: two bits of a
    register that hold one sign would keep the product's register outside.  Those of two blocks both stay: blocks that
    begin together count their clocks each for itself, and one that stood for all would be far from most."""
    first: dict[str, int] = {}
    same: dict[int, int] = {}
    for name, cell in list(module["cells"].items()):
        if cell["type"] != "TRELLIS_FF" or cell.get("attributes", {}).get("keep") or "DI" not in cell["connections"]:
            continue
        inputs = {port: bits for port, bits in cell["connections"].items() if port != "Q"}
        (bit,) = cell["connections"]["Q"]
        block = name.rpartition(".")[0]
        kept = first.setdefault(json.dumps([block, cell["parameters"], inputs], sort_keys=True), bit)
        if kept != bit:
            same[bit] = kept
            del module["cells"][name]
    wired = [cell["connections"] for cell in module["cells"].values()]
    for connections in wired:
        connections.update({port: [same.get(b, b) for b in bits] for port, bits in connections.items()})
    for named in (*module["ports"].values(), *module.get("netnames", {}).values()):
        named["bits"] = [same.get(b, b) for b in named["bits"]]
    return len(same)


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
