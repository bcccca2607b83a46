"""Moves flip-flops around an ECP5 multiplier into it, where they are what its own registers do.

A MULT18X18D has registers at A, B and P.  yosys uses the like for Xilinx, not for ECP5: there every multiplication
then runs from flip-flop to flip-flop through 3.9 ns of multiplier and twice the routing.  This pass edits the mapped
netlist (yosys' JSON) before place and route.

The operands' registers move in if each bit of both is 0 or comes from a flip-flop, all of an operand with the same
clock and enable, none with reset or initial 1; the flip-flops stay where something else reads them too.  One operand
alone does not: nextpnr then times the multiplier as if neither had a register.  A flip-flop stands beside its LUT, a
multiplier does not: so they move only where the longer of the two paths gets shorter, by `Delays`, or hardly longer.
The product's moves in if each used bit goes to one such flip-flop and nowhere else.
"""

from __future__ import annotations

from scripts.synth.delays import MULTIPLIER, NET, TO_Q, Delays
from scripts.synth.netlist import BITS, Nets, control_of, set_register

ALIKE = 0.1  # ns by which the longer path may get longer: the shorter one is shorter by as much as a net or two


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
        operands = [operand_of(cell, side, cells, nets) for side in ("A", "B")]
        if all(operands) and shorter(cell, [bit for _, before in operands for bit in before.values()], cells, nets):
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


def shorter(cell: dict, before: list[int], cells: dict, nets: Nets) -> bool:
    """Whether the longer of the paths to and through the multiplier is shorter with its operands' registers inside;
    ``before`` = the bits in front of them."""
    delays = Delays(cells, nets)
    arrival = max(map(delays.arrival, before))
    rest = 0.0
    if "REG_OUTPUT_CLK" not in cell["parameters"]:
        products = (cell["connections"].get(f"P{n}", ["0"])[0] for n in range(BITS["P"]))
        rest = max(map(delays.rest, products))
    return max(arrival + NET, MULTIPLIER + rest) < ALIKE + max(arrival, TO_Q + NET + MULTIPLIER + rest)


def operand_of(cell: dict, side: str, cells: dict, nets: Nets):
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
