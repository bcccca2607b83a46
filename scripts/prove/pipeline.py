# SPDX-License-Identifier: BSD-3-Clause
"""Every block's out_valid: exactly LATENCY clocks after in_valid, never without a sample, none after a reset.

The harness is generated from the block's declaration, so a new block of the registry needs no code here.
"""

from __future__ import annotations

import re
from functools import partial

from fluxproof.checkout import ROOT
from golden_model import fluxproof
from golden_model.block import Block
from golden_model.registry import BLOCKS
from scripts.prove.proof import Fault, Proof

_PORT = re.compile(r"\b(input|output)\s+(\[\d+:0\]\s*)?(\w+)")


def ports(verilog: str, entity: str) -> list[tuple[str, str, str]]:
    """(direction, range, name) of each port of the module."""
    header = re.search(rf"^module {entity}\s*\((.*?)\);", verilog, re.MULTILINE | re.DOTALL)
    return [(direction, width.strip(), name) for direction, width, name in _PORT.findall(header.group(1))]


def harness(
    entity: str, start: str, ends: tuple[tuple[str, int], ...], interval: int, verilog: str, guarded: bool = False
) -> str:
    """``formal_top``: each strobe of ``ends`` is ``start`` that many clocks ago, samples ``interval`` clocks apart.

    guarded: the entity has a sample_guard; the harness also shows that it accepts all these samples.
    """
    found = ports(verilog, entity)
    inputs = [
        f"    input {width} {name}".replace("  ", " ") for direction, width, name in found if direction == "input"
    ]
    strobes = {name for name, _ in ends} | ({"sample_busy", "early_samples"} if guarded else set())
    wired = [f".{name}({name})" for direction, _, name in found if direction == "input" or name in strobes]
    longest = max(latency for _, latency in ends)
    checks = "\n".join(f"    assert ({name} == flight[{latency - 1}]);\n    cover ({name});" for name, latency in ends)
    header, wires = (
        ",\n".join(inputs),
        "\n  ".join(f"wire {width} {name};" for _, width, name in found if name in strobes),
    )
    if guarded:
        checks += f"""
    assert (early_samples == 0);
    if (!{start}) assert (!sample_busy || since < {interval});"""
    return f"""\
// Made from the declarations of {entity}.
module formal_top (
{header}
);
  {wires}
  {entity} dut ({", ".join(wired)});

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // Samples keep their distance, whatever resets come between.
  reg [7:0] since = {interval};
  always @(posedge clk) since <= {start} ? 1 : since < {interval} ? since + 1 : since;
  always @* if ({start}) assume (since >= {interval});

  // flight[k]: a sample went in k + 1 clocks ago and no reset has come since
  reg [{longest - 1}:0] flight;
  always @(posedge clk) flight <= rst ? 0 : {{flight, {start}}};

  always @(posedge clk) if (begun) begin
{checks}
    assert (since <= {interval});
  end
endmodule
"""


def fault_files(block: Block) -> list[str]:
    """The block's file, then those of its sub-entities, and of theirs."""
    rtl = ROOT / "rtl"
    files = [block.vhdl]
    for file in files:  # grows as it goes
        inner = re.findall(r"entity work\.(\w+)", (rtl / file).read_text())
        found = [str(p.relative_to(rtl)) for name in inner for p in rtl.rglob(f"{name}.vhd")]
        files += [name for name in dict.fromkeys(found) if name not in files]
    return files


# Code patterns of the blocks in the order of preference: (what the fault breaks, text, its replacement).
PATTERNS = (
    ("valid a clock early", "out_valid <= valid(LATENCY);", "out_valid <= valid(LATENCY - 1);"),
    (
        "valid a clock early",
        "out_valid <= '1' when n = LATENCY else '0';",
        "out_valid <= '1' when n = LATENCY - 1 else '0';",
    ),
    ("valid a clock early", "if age = LATENCY - 1 then", "if age = LATENCY - 2 then"),
    ("valid survives reset", "        valid(1 to LATENCY) <= (others => '0');\n", "        null;\n"),
    ("valid survives reset", "out_valid <= '0';", "null;"),
)
SOON = (
    ("first outputs reported with the last", "out_soon  <= valid(LATENCY - 1);", "out_soon  <= valid(LATENCY);"),
    (
        "first outputs reported late",
        "out_soon  <= valid(LATENCY - SINCOS_SECOND);",
        "out_soon  <= valid(LATENCY - SINCOS_SECOND + 1);",
    ),
    (
        "first outputs reported late",
        "out_soon  <= valid(LATENCY - U_DC_CONDITIONING_AHEAD);",
        "out_soon  <= valid(LATENCY - U_DC_CONDITIONING_AHEAD + 1);",
    ),
)


def faults(block: Block) -> tuple[Fault, ...]:
    """Up to two faults of the strobe and one of out_soon, in the block or in the sub-entity that generates it."""
    made: dict[str, Fault] = {}
    for file in fault_files(block):
        text = (ROOT / "rtl" / file).read_text()
        for says, old, new in (*PATTERNS, *(SOON if block.soon else ())):
            found = re.findall(re.escape(old).replace(r"\ <=", " +<="), text)  # however it is aligned
            if len(found) == 1:
                made.setdefault(says, Fault(says, file, found[0], new))
    return tuple(made.values())


def block_proof(block: Block) -> Proof:
    soon = (("out_soon", block.latency - block.ahead),) if block.soon else ()
    ends = (("out_valid", block.latency), *soon)
    ahead = "one clock" if block.ahead == 1 else f"{block.ahead} clocks"
    return Proof(
        name=f"pipeline_{block.name}",
        says=f"out_valid of {block.name} comes {block.latency} clocks after in_valid, never otherwise; reset clears"
        + (f", out_soon {ahead} before" if block.soon else ""),
        entity=block.name,
        harness=partial(harness, block.name, "in_valid", ends, block.interval),
        faults=faults(block),
        depth=block.latency + 2,
        generics=dict(block.configs[0]),
        assumed=f"samples at least {block.interval} clocks apart" if block.interval > 1 else "nothing",
        search_depth=2 * block.latency + 4,
    )


def core_ends() -> tuple[tuple[str, int], ...]:
    """The strobes of the whole core with their clocks, from the declared latencies."""
    times = fluxproof.schedule()
    return tuple(
        (name, times[instance][1])
        for name, instance in (
            ("duty_valid", "modulator"),
            ("compare_valid", "compare"),
            ("values_valid", "monitor"),
        )
    )


def core_proof() -> Proof:
    ends = core_ends()
    longest = max(latency for _, latency in ends)
    return Proof(
        name="pipeline_fluxproof",
        says="duty_valid, compare_valid and values_valid of the core come at their declared clocks, never otherwise",
        entity="fluxproof_flat",
        harness=partial(harness, "fluxproof_flat", "sample_valid", ends, fluxproof.SAMPLE_INTERVAL, guarded=True),
        faults=(
            Fault(
                "compare starts with the voltage",
                "fluxproof.vhd",
                "in_valid => duty_ready,",
                "in_valid => ab_voltage_valid,",
            ),
            Fault(
                "currents in flight survive the reset",
                "transforms/clarke.vhd",
                "        valid(1 to LATENCY) <= (others => '0');\n",
                "        null;\n",
            ),
        ),
        depth=fluxproof.SAMPLE_INTERVAL + 4,  # a rejected sample is reported one clock later
        generics={"CARRIER_HALF": 10000},
        assumed=f"samples at least {fluxproof.SAMPLE_INTERVAL} clocks apart",
        search_depth=2 * longest,
    )


def proofs() -> tuple[Proof, ...]:
    return (*(block_proof(b) for b in BLOCKS.values() if b.strobes and not b.clocked), core_proof())
