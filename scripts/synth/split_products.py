"""Moves the register behind a product of more than 18 x 18 bits to before the adder that puts its parts together.

A 7-series multiplier takes 25 x 18 bits and has its product's register inside.  On ECP5 yosys makes it of two
MULT18X18D, whose parts an adder sums before the register: a multiplier, a carry chain and two nets between two clocks
where the VHDL says a multiplication.  This pass edits the mapped netlist (yosys' JSON): the parts go into the
multipliers' own product registers, what else the adder takes into flip-flops of the same control, and the sum is made
behind them.  Every register of the VHDL keeps its values at every clock; only the adder changes sides.

Where the VHDL gives the operands two registers each, the second goes behind the multipliers instead, and the register
behind the adder stays: a clock for the multiplication, one for the adder.

The first is done where that shortens the longer of the two paths by `Delays`, a rough sum of cells and nets: not where
the adder would meet a long path behind the register.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from scripts.synth.delays import TO_Q, Delays
from scripts.synth.multiplier_registers import operand_of
from scripts.synth.netlist import ADDER, BITS, CONSTANTS, Control, Nets, control_of, outputs, set_register


@dataclass
class Cloud:
    """What stands between the products and their register: names of cells; ``into`` = bits that come from elsewhere."""

    multipliers: list[str] = field(default_factory=list)
    adders: list[str] = field(default_factory=list)
    flip_flops: list[str] = field(default_factory=list)
    into: list[int] = field(default_factory=list)


def cloud_of(start: str, cells: dict, nets: Nets) -> tuple[Cloud, Control] | None:
    """Adders and registers behind the product of ``start``; None where anything but adders leads to registers."""
    cloud, control = Cloud(), set()
    waiting, seen = [start], {start}

    def meet(name: str) -> None:
        if name not in seen:
            seen.add(name)
            waiting.append(name)

    while waiting:
        name = waiting.pop()
        cell = cells[name]
        (cloud.multipliers if cell["type"] == "MULT18X18D" else cloud.adders).append(name)
        if cell["type"] == ADDER:
            for port, bits in cell["connections"].items():
                maker = nets.driver.get(bits[0], "") if cell["port_directions"][port] == "input" else ""
                # A carry is never cut, and a product is registered whole.
                if maker and (port == "CIN" or cells[maker]["type"] == "MULT18X18D"):
                    meet(maker)
        for bit in outputs(cell):
            for reader, port in nets.readers.get(bit, []):
                kind = cells[reader]["type"] if reader else "pad"
                if kind == "TRELLIS_FF" and port == "DI":
                    control.add(control_of(cells[reader]))
                    cloud.flip_flops.append(reader)
                elif kind == ADDER:
                    meet(reader)
                else:
                    return None
    if (
        any(cells[name]["type"] not in ("MULT18X18D", ADDER) for name in seen)
        or len(control) != 1
        or None in control
    ):
        return None
    inside = {bit for name in seen for bit in outputs(cells[name])}
    into = {
        bits[0]
        for name in cloud.adders
        for port, bits in cells[name]["connections"].items()
        if cells[name]["port_directions"][port] == "input" and bits[0] not in CONSTANTS
    }
    cloud.into = sorted(into - inside)
    return cloud, control.pop()


def second_registers(cloud: Cloud, cells: dict, nets: Nets) -> tuple[Control, dict[str, dict[str, int]]] | None:
    """(control, {multiplier: {pin: bit in front of its flip-flop}}) where all operands come from flip-flops of one
    control, and those from others that nothing else reads; else None."""
    operands = {(name, side): operand_of(cells[name], side, cells, nets) for name in cloud.multipliers for side in "AB"}
    if cloud.into or not all(operands.values()):
        return None
    control, *others = {control for control, _ in operands.values()}
    before = {name: operands[name, "A"][1] | operands[name, "B"][1] for name in cloud.multipliers}
    bits = {bit for pins in before.values() for bit in pins.values()}
    readers = [reader for bit in bits for reader in nets.readers[bit]]
    if others or not bits <= nets.flip_flop.keys() or any(port != "DI" for _, port in readers):
        return None
    return control, before


def product_of(cell: dict) -> dict[str, int]:
    """{pin: bit} of the product."""
    pins = (f"P{n}" for n in range(BITS["P"]))
    return {pin: cell["connections"][pin][0] for pin in pins if pin in cell["connections"]}


def shorter(cloud: Cloud, cells: dict, delays: Delays) -> bool:
    """Whether the longer of the two paths is shorter with the register in front of the adder."""
    behind = [cells[name]["connections"] for name in cloud.flip_flops]
    now = max(max(delays.arrival(c["DI"][0]), TO_Q + delays.rest(c["Q"][0])) for c in behind)
    products = [bit for name in cloud.multipliers for bit in outputs(cells[name])]
    from_product = {bit: delays.arrival(bit) for bit in (*products, *cloud.into)}
    adder = max(delays.arrival(c["DI"][0]) for c in behind) - max(from_product.values())
    then = max(*from_product.values(), TO_Q + adder + max(delays.rest(c["Q"][0]) for c in behind))
    return then < now


def retime(netlist: dict, top: str) -> dict[str, int]:
    """Changes ``netlist`` in place; {"multipliers", "removed", "added"}: how many registered now, and flip-flops."""
    cells = netlist["modules"][top]["cells"]
    done = {"multipliers": 0, "removed": 0, "added": 0}
    for start in [name for name, cell in cells.items() if cell["type"] == "MULT18X18D"]:
        if "REG_OUTPUT_CLK" in cells[start]["parameters"]:
            continue
        nets = Nets(netlist["modules"][top])
        found = cloud_of(start, cells, nets)
        if not found or not found[0].adders:
            continue
        cloud, control = found
        if twice := second_registers(cloud, cells, nets):
            control, before = twice
            passed = {cells[name]["connections"][pin][0] for name, pins in before.items() for pin in pins}
            for name, pins in before.items():
                cells[name]["connections"].update({pin: [bit] for pin, bit in pins.items()})
                set_register(cells[name], "P", control, product_of(cells[name]))
            unread = [bit for bit in passed if all(name in before for name, _ in nets.readers[bit])]
            for bit in unread:
                del cells[nets.flip_flop[bit]]
            done["multipliers"] += len(before)
            done["removed"] += len(unread)
            continue
        behind = [cells[name]["connections"] for name in cloud.flip_flops]
        if len({c["DI"][0] for c in behind}) != len(behind) or not shorter(cloud, cells, Delays(cells, nets)):
            continue
        model = cells[cloud.flip_flops[0]]
        moved = {c["DI"][0]: c["Q"][0] for c in behind}
        for n, bit in enumerate(cloud.into):
            moved[bit] = nets.free
            nets.free += 1
            connections = {**model["connections"], "DI": [bit], "Q": [moved[bit]]}
            cells[f"{cloud.flip_flops[0]}_before_{n}"] = {**model, "connections": connections}
        for name in cloud.multipliers + cloud.adders:
            connections = cells[name]["connections"]
            connections.update({port: [moved.get(bits[0], bits[0])] for port, bits in connections.items()})
            if name in cloud.multipliers:
                set_register(cells[name], "P", control, product_of(cells[name]))
        for name in cloud.flip_flops:
            del cells[name]
        done["multipliers"] += len(cloud.multipliers)
        done["removed"] += len(cloud.flip_flops)
        done["added"] += len(cloud.into)
    return done
