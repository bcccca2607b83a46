"""About how long after a clock a bit of a mapped ECP5 netlist is there, and how long before the next it must be.

A rough sum, cells as in nextpnr's reports and every net at what one costs there.  It chooses between places for a
register and tells ABC what a net costs; no reported figure comes from it.
"""

from __future__ import annotations

from scripts.synth.netlist import CONSTANTS, Nets, outputs

# ns on LFE5U speed grade 6
NET, TO_Q, MULTIPLIER, MEMORY, CARRY_STEP = 1.7, 0.5, 3.9, 5.6, 0.07
THROUGH = {"LUT4": 0.24, "PFUMX": 0.2, "L6MUX21": 0.2, "CCU2C": 0.45, "MULT18X18D": MULTIPLIER}
CONTROL = ("CLK", "CE", "RST")  # pins of a multiplier that lead to its registers alone
INSIDE = ("PFUMX", "L6MUX21")  # their inputs come over wires of the slice


class Delays:
    """About how long after a clock a bit is there, and how long before the next it must be."""

    def __init__(self, cells: dict, nets: Nets):
        self._cells, self._nets = cells, nets
        self._arrival: dict = {}
        self._rest: dict = {}

    def arrival(self, bit) -> float:
        """ns from the clock to ``bit``, at the pin that makes it."""
        if bit not in self._arrival:
            self._arrival[bit] = 0.0  # a loop, if there were one, ends here
            self._arrival[bit] = self._made(bit)
        return self._arrival[bit]

    def _made(self, bit) -> float:
        name = self._nets.driver.get(bit)
        cell = self._cells.get(name, {"type": "input"})
        if cell["type"] == "DP16KD":
            return MEMORY
        if cell["type"] not in THROUGH or "REG_OUTPUT_CLK" in cell["parameters"]:
            return TO_Q
        if "REG_INPUTA_CLK" in cell["parameters"]:
            return MULTIPLIER
        return max(self._inputs(cell), default=0.0)

    def _inputs(self, cell: dict):
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "input" and bits[0] not in CONSTANTS:
                yield self.arrival(bits[0]) + step(cell, port)

    def rest(self, bit) -> float:
        """ns from the pin that makes ``bit`` to the next register."""
        if bit not in self._rest:
            self._rest[bit] = 0.0
            self._rest[bit] = max(
                (self._onward(*reader) for reader in self._nets.readers.get(bit, [])), default=0.0
            )
        return self._rest[bit]

    def _onward(self, name: str, port: str) -> float:
        cell = self._cells.get(name, {"type": "output"})
        control = cell["type"] == "MULT18X18D" and port.startswith(CONTROL)
        if cell["type"] not in THROUGH or control or "REG_INPUTA_CLK" in cell["parameters"]:
            return NET
        if "REG_OUTPUT_CLK" in cell["parameters"]:
            return NET + MULTIPLIER
        return step(cell, port) + max(self.rest(bit) for bit in outputs(cell))


def step(cell: dict, port: str) -> float:
    """ns from the pin that feeds ``port`` through the cell."""
    if port == "CIN":
        return CARRY_STEP
    return THROUGH[cell["type"]] + (0.0 if cell["type"] in INSIDE and port != "C0" else NET)
