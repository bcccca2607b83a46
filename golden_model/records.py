# SPDX-License-Identifier: BSD-3-Clause
"""The records at the core's ports: declared here once, written into fluxproof_pkg.vhd by `make generate`.

* sample_t: what a sample brings: the fields of fluxproof.Sample but ``run``, which the core knows itself.
* settings_t: the registers of all blocks, fluxproof.REGISTERS.
* observed_t, estimated_t: the values of a sample that the core shows, fluxproof.Observed; the second those of the
  estimators.

A code in sample_t has the width of the widest converter, right-aligned; of its bits the core reads as many as its
generics say.
"""

from dataclasses import replace

from golden_model import estimation, fluxproof, formats
from golden_model.block import Port
from golden_model.fixed import Format
from golden_model.io import sample_latch

WIDEST = {"ADC_BITS": 16, "POSITION_BITS": 18}
# Field of sample_t -> the name of the value as an input of sample_latch.
ENTERS_AS = {name.removesuffix("_in"): name for name in sample_latch.NAMES if name != "run_in"}
_OBSERVED, _ESTIMATED = fluxproof.OBSERVED, estimation.Estimated._fields
_LATCHED = {p.name: p for p in sample_latch.BLOCK.ports(WIDEST)}
_NAMED = {fmt: f"{name}_W - 1" for name, fmt in reversed(list(vars(formats).items())) if isinstance(fmt, Format)}

RECORDS: dict[str, dict[str, Port]] = {
    "sample_t": {field: replace(_LATCHED[name], name=field) for field, name in ENTERS_AS.items()},
    "settings_t": dict(fluxproof.REGISTERS),
    "observed_t": {n: _OBSERVED[n] for n in fluxproof.Observed._fields if n not in _ESTIMATED},
    "estimated_t": {n: _OBSERVED[n] for n in _ESTIMATED},
}


def generic_of(name: str) -> str | None:
    """The generic that is the width of a code at sample_latch; None for a value of another kind."""
    size = sample_latch.BLOCK.width_from.get(name)
    if size is None:
        return None
    width = size(WIDEST).width
    return next(generic for generic, bits in WIDEST.items() if bits == width)


def vhdl_type(port: Port, generic: str | None = None) -> str:
    """The VHDL type of a value; shared formats use their named width, codes the ``generic`` if one is given."""
    if port.is_bit:
        return "std_logic"
    kind = "signed" if port.fmt.signed else "unsigned"
    top = f"{generic} - 1" if generic else _NAMED.get(port.fmt, port.fmt.width - 1)
    return f"{kind}({top} downto 0)"
