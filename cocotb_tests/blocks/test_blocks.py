# SPDX-License-Identifier: BSD-3-Clause
"""Every registered block: RTL equal to its model in every bit, model within its bound of the float reference."""

from __future__ import annotations

import inspect
import math
import os
import re
import sys

import numpy as np
import pytest

import golden_model
from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim import bench_plan, ghdl
from fluxproof.cosim.stimulus import MEDIUM, samples
from golden_model import registry
from golden_model.control import current_limit
from golden_model.registry import BLOCKS

SEED = int(os.environ.get("FLUXPROOF_SEED", "1"))
CASES = [(b, k) for b in BLOCKS.values() for k in range(len(b.configs))]
IDS = [f"{b.name}-{k}" for b, k in CASES]
WITHOUT_MODEL = {"fluxproof", "protection"}  # only instantiate; the closed loop compares them
WITHOUT_MODEL |= {"axi_lite_slave", "register_access", "register_file"}  # one twin for a transfer: test_registers_axi
WITHOUT_MODEL |= {"board_register_file", "fluxproof_board"}  # the same with a board's registers: test_closed_loop
WITHOUT_MODEL |= {"motor_model", "motor_map", "motor_waves", "core_and_motor", "motor_bench"}  # test_motor_model
WITHOUT_MODEL |= {"hil_register_file", "fluxproof_hil"}  # wiring: test_hil_top
WITHOUT_MODEL |= {"fluxproof_axi", "power_stage"}  # instantiates; has no clock: test_axi_top, test_power_stage


@pytest.mark.parametrize(("block", "config"), CASES, ids=IDS)
def test_rtl_equals_model(block, config):
    # The ports of a cell have no widths of their own; a top in tb/ gives them.
    top, extra = (block.name, ()) if block.strobes else (f"{block.name}_tb", (ROOT / "tb" / f"{block.name}_tb.vhd",))
    generics = dict(block.configs[config])
    path = bench_plan.write(ghdl.run_folder(top, generics) / "bench.pickle", block, config, SEED)
    # The bench asserts nothing that pytest would have to explain: it is not loaded into the simulator.
    environment = {"FLUXPROOF_BENCH": str(path), "COCOTB_REWRITE_ASSERTION_FILES": ""}
    folder = ghdl.run(top, "fluxproof.cosim.block_bench", generics, environment, extra=extra)
    problem = ghdl.failure(folder)
    assert problem is None, problem


@pytest.mark.parametrize(
    ("block", "config"),
    [c for c in CASES if c[0].reference],
    ids=[i for i, c in zip(IDS, CASES, strict=True) if c[0].reference],
)
def test_model_within_bound(block, config):
    generics = block.configs[config]
    state, worst = block.state, {}
    formats = {p.name: p.fmt for p in block.ports(generics)}
    out_formats = {p.name: p.fmt for p in block.out_ports(generics)}
    for row, _ in samples(block, generics, SEED, MEDIUM):
        real = {name: formats[name].to_float(value) for name, value in row.items()} | dict(generics)
        wanted, allowed = block.reference(real, state), block.bound(real, state)
        state, got = block.run(state, row, generics)
        for name, value in wanted.items():
            error = out_formats[name].to_float(got[name]) - value
            if out_formats[name].int_bits == 0 and name.startswith("theta"):
                error = (error + 0.5) % 1.0 - 0.5  # an angle
            assert abs(error) <= allowed[name] + 1e-12, (name, row, got[name], value, error, allowed[name])
            worst[name] = max(worst.get(name, 0.0), abs(error) / max(allowed[name], 1e-30))
    if block.name != "pwm_compare":
        assert set(worst) >= {p.name for p in block.outputs if _is_quantity(p)}


def test_a_block_with_quantities_has_a_reference():
    """Where the sample is the clock the outputs are codes that were taken over; else a quantity has a float twin."""
    missing = {
        b.name for b in BLOCKS.values() if not b.clocked and not b.reference and any(map(_is_quantity, b.outputs))
    }
    assert missing == {"current_limit"}  # its outputs are those of the sample before: the next test


def test_current_limit_is_the_circle():
    """i_d within the circle exactly, i_q_max what is left of it within one LSB below."""
    rng = np.random.default_rng(SEED)
    for row in current_limit.stimuli(rng, {}):
        state, _ = current_limit.step(current_limit.State(), **row)
        i_d = max(-row["i_max"], min(row["i_max"], row["i_d_ref"]))
        assert state.i_d == i_d
        assert 0 <= math.sqrt(row["i_max"] ** 2 - i_d**2) - state.i_q_max < 1


def _is_quantity(port) -> bool:
    """Flags and limiter signs are exact by ==; everything else must have a float reference."""
    return port.fmt.frac_bits > 0


def test_every_entity_has_a_model():
    """Every arithmetic entity has a registered model, and its file has the name of the entity."""
    for path in sorted(RTL.rglob("*.vhd")):
        entities = re.findall(r"^entity (\w+) is", path.read_text(), re.MULTILINE)
        if path.stem.endswith("_pkg"):
            assert not entities, f"{path.name} is a package and holds an entity"
            continue
        assert entities == [path.stem], f"{path.name} must hold the one entity {path.stem}"
        if path.stem not in WITHOUT_MODEL:
            assert path.stem in BLOCKS, (
                f"{path.stem} has no model golden_model/{path.parent.name}/{path.stem}.py with a BLOCK"
            )
            assert BLOCKS[path.stem].vhdl == f"{path.parent.name}/{path.name}", f"{path.name} is in the wrong folder"


def test_models_mirror_the_rtl():
    for block in BLOCKS.values():
        assert (RTL / block.vhdl).exists()


def test_a_step_takes_its_ports():
    """By position or in records, in the order of the declaration, as the bench and the callers read it."""
    for block in BLOCKS.values():
        ports = [p.name for p in block.inputs + block.registers]
        if block.takes:
            assert [name for record in block.takes for name in record._fields] == ports, block.name
            ports = ["inputs", "regs"][: len(block.takes)]
        parameters = inspect.signature(getattr(block.step, "py_func", block.step)).parameters.values()
        named = [p.name for p in parameters if p.kind is not p.VAR_POSITIONAL][0 if block.state is None else 1 :]
        if any(p.kind is p.VAR_POSITIONAL for p in parameters):  # the rest as *values
            ports = ports[: len(named)]
        assert named[: len(ports)] == ports, block.name


@pytest.mark.parametrize("declared", ["fresh", "stale"])
def test_a_file_in_a_room_is_a_block(declared, tmp_path, monkeypatch):
    """A block is registered by its file; one that declares another name than its file's is refused by name."""
    room = tmp_path / "attic"
    room.mkdir()
    (room / "__init__.py").touch()
    (room / "helper.py").write_text("NOTHING = 0\n")
    block = f'Block("{declared}", "attic", "none", None, (), (), 1, None, None)'
    (room / "fresh.py").write_text(f"from golden_model.block import Block\n\nBLOCK = {block}\n")
    monkeypatch.setattr(golden_model, "__path__", [*golden_model.__path__, str(tmp_path)])
    for name in ("golden_model.attic", "golden_model.attic.fresh", "golden_model.attic.helper"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    if declared == "stale":
        with pytest.raises(ValueError, match=r"attic/fresh\.py: BLOCK declares .*stale"):
            registry.found()
    else:
        assert set(registry.found()) == {*BLOCKS, "fresh"}


def test_sincos_at_every_angle():
    """The error is within its bound at all 2**18 angles, and the magnitude is 1 within twice the bound."""
    from golden_model.transforms import sincos

    bound = sincos.bound(None, None)["cos_theta"]
    angles = np.arange(1 << 18)
    got = np.array([sincos.turn(int(t)) for t in angles]) * 2.0**-16
    exact = np.stack([np.cos(angles * 2 * np.pi / 2**18), np.sin(angles * 2 * np.pi / 2**18)], axis=1)
    assert np.abs(got - exact).max() <= bound
    assert np.abs(np.hypot(*got.T) - 1).max() <= 2 * bound


def test_u_dc_reciprocal_over_the_whole_range():
    """U_dc as 2**n/m: relative error at most 2**-17 for every code from 1/32 to full scale."""
    from golden_model.io import u_dc_processing

    for u_dc in range(u_dc_processing.U_DC_MIN, 1 << 17):
        inverse, _beta, low = u_dc_processing.step(u_dc)
        assert low == 0
        assert abs(inverse * 2.0**-17 * (u_dc * 2.0**-16) - 1) <= 2.0**-17
    below = u_dc_processing.step(u_dc_processing.U_DC_MIN)[:2]
    for u_dc in (0, 1, u_dc_processing.U_DC_MIN - 1):
        assert u_dc_processing.step(u_dc) == (*below, 1)


def test_docs_list_every_block():
    """docs/blocks.md has one row per block, with the declared latency and interval."""
    table = (ROOT / "docs" / "blocks.md").read_text()
    rows = {m[0]: m[1:] for m in re.findall(r"^\| `(\w+)` \| (\w+) \| (\d+) \| (\d+) \|", table, re.MULTILINE)}
    assert rows == {b.name: (b.folder, str(b.latency), str(b.interval)) for b in BLOCKS.values()}
