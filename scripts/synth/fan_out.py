"""Copies a register or a LUT that more cells read than one place in the chip is near to, and shares its readers out.

A valid bit enables dozens of flip-flops and chooses for dozens of LUTs; a reset reaches thousands.  nextpnr keeps one
such cell in one place.  Readers are shared out in the order of their names, which the blocks and registers of the VHDL
gave them: those of one register stay together.
"""

from __future__ import annotations

from scripts.synth.netlist import Nets

OUTPUT = {"TRELLIS_FF": "Q", "LUT4": "Z"}
MOST = 32  # readers of one copy
COPY = "_copy_"  # stands in a copy's name behind that of the cell it copies


def share_out(netlist: dict, top: str, most: int = MOST) -> int:
    """Changes ``netlist`` in place; how many copies were added."""
    module = netlist["modules"][top]
    cells, nets = module["cells"], Nets(module)
    added = 0
    waiting = sorted(nets.driver)
    while waiting:
        bit = waiting.pop()
        name, readers = nets.driver[bit], nets.readers.get(bit, [])
        model = cells[name]
        kept = model.get("attributes", {}).get("keep")
        if len(readers) <= most or model["type"] not in OUTPUT or kept or any(not cell for cell, _ in readers):
            continue
        given = [(port, bits[0]) for port, bits in model["connections"].items() if port != OUTPUT[model["type"]]]
        readers.sort()
        share = -(-len(readers) // -(-len(readers) // most))
        nets.readers[bit] = readers[:share]
        for start in range(share, len(readers), share):
            copy, made = f"{name}{COPY}{nets.free}", nets.free
            nets.free += 1
            cells[copy] = {**model, "connections": {**model["connections"], OUTPUT[model["type"]]: [made]}}
            nets.driver[made], nets.readers[made] = copy, readers[start : start + share]
            for cell, port in nets.readers[made]:
                connections = cells[cell]["connections"]
                moved = [made if old == bit else old for old in connections[port]]
                cells[cell]["connections"] = {**connections, port: moved}
            for port, source in given:
                if not isinstance(source, str) and port != "CLK":
                    nets.readers[source].append((copy, port))
            added += 1
        # What the copies read has more readers now.
        waiting += [source for _, source in given if source in nets.driver]
    return added
