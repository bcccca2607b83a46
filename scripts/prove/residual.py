# SPDX-License-Identifier: BSD-3-Clause
"""Properties of motor_residual: which samples have no residual, and how soon the flag can rise."""

from __future__ import annotations

from scripts.prove.pipeline import ports
from scripts.prove.proof import Fault, Proof

ENTITY, FILE = "motor_residual", "estimators/motor_residual.vhd"

CHECKS = {
    "RESTS": """\
    // Without switching gates, or with a current at its rail, there is no residual.
    if (n > 23 && (!run || current_at_rail != 0)) assert (residual_d == 0 && residual_q == 0);
""",
    "PATIENCE": """\
    // The flag needs residual_samples samples with switching gates; with 0 there is none.
    if (n == 38 && motor_differs) assert (run && residual_samples != 0 && counted >= residual_samples);
""",
}
LEMMAS = """\
    assert (spy_n == n);
    assert (spy_count <= counted);
"""


def harness(verilog: str) -> str:
    """``formal_top``: samples at least 38 clocks apart; one property at a time by its macro."""
    found = ports(verilog, ENTITY)
    lemmas = "spy_count" in verilog
    inputs = [f"    input {width} {name}" for direction, width, name in found if direction == "input"]
    wires = [f"  wire {width} {name};" for direction, width, name in found if direction == "output"]
    wired = ", ".join(f".{name}({name})" for _, _, name in found)
    checks = "\n".join(f"`ifdef {macro}\n{text}`endif" for macro, text in CHECKS.items())
    return f"""\
// Made from the ports of {ENTITY}.
module formal_top (
{(f",{chr(10)}").join(inputs)}
);
{chr(10).join(wires)}
  {ENTITY} dut ({wired});

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // n: clocks since a sample went in, 0 without one
  reg [5:0] n = 0;
  always @(posedge clk) n <= rst ? 0 : in_valid ? 1 : n == 38 || n == 0 ? 0 : n + 1;
  always @* if (in_valid) assume (n == 0 || n == 38);
  always @(posedge clk) if (begun && n != 0) assume ($stable({{run, residual_samples, current_at_rail}}));

  // Samples with switching gates since one without
  reg [11:0] counted = 0;
  always @(posedge clk) counted <= rst ? 0 : n != 36 ? counted : !run ? 0 : &counted ? counted : counted + 1;

  always @(posedge clk) if (begun) begin
{LEMMAS if lemmas else ""}{checks}
  end
endmodule
"""


def proof(name: str, says: str, *faults: Fault) -> Proof:
    return Proof(
        name=f"residual_{name}",
        says=says,
        entity=ENTITY,
        harness=harness,
        faults=faults,
        depth=8,
        macros=(name.upper(),),
        spies=("n", "count"),
        free=("prod",),
        assumed="samples at least 38 clocks apart, run, rails and residual_samples constant meanwhile; any products",
        search_depth=80,
        covers=False,  # the search reaches each fault, and so what is asserted
    )


PROOFS = (
    proof(
        "rests",
        "a sample without switching gates, or with a current at its rail, has no residual",
        Fault("residual of a limited current", FILE, "known = '1' and run = '1' and current_at_rail = 0",
              "known = '1' and run = '1'"),
        Fault("residual without switching gates", FILE, "known = '1' and run = '1' and current_at_rail = 0",
              "known = '1' and current_at_rail = 0"),
    ),
    proof(
        "patience",
        "motor_differs needs residual_samples samples since the gates began to switch; 0 leaves it off",
        Fault("flag of the first sample", FILE, "count >= residual_samples and count /= 0", "count /= 0"),
        Fault("counts though it is off", FILE, "if run = '0' or residual_samples = 0 then", "if run = '0' then"),
    ),
)  # fmt: skip
