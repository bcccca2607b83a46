# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on one property: is it proved, are its covers reachable, are its planted faults detected?"""

from __future__ import annotations

from fluxproof.checkout import ROOT
from scripts.prove.proof import Proof
from scripts.prove.solve import FOLDER, BrokenProof, ask, plant

RTL = ROOT / "rtl"


def judge(proof: Proof, limit: int) -> dict:
    """Run all checks of ``proof``; returns an entry of result.json, ``reason`` names a failed check."""
    entry = {
        "property": proof.name,
        "mode": proof.mode,
        "depth": None if proof.method == "pdr" else proof.depth,
        "pass": False,
        "mutant_caught": False,
        "method": proof.method,
        "entity": proof.entity,
        "generics": dict(proof.generics),
        "says": proof.says,
        "assumed": proof.assumed,
        "covered": None,
        "mutants": [],
        "seconds": 0.0,
        "reason": "",
    }
    try:
        _prove(proof, entry, limit)
        _search(proof, entry, limit)
    except BrokenProof as error:
        entry["reason"] = str(error)
        entry["pass"] = entry["mutant_caught"] = False
    entry["seconds"] = round(entry["seconds"], 1)
    return entry


def _prove(proof: Proof, entry: dict, limit: int) -> None:
    limit = max(limit, proof.patience)
    answer = ask(proof, "proof", proof.method, proof.depth, proof.generics, RTL, True, limit)
    entry["seconds"] += answer.seconds
    entry["pass"] = answer.status == "PASS"
    if not entry["pass"]:
        words = {"FAIL": "it is not so", "TIMEOUT": f"no answer within {limit} s: not proved"}
        entry["reason"] = f"{words.get(answer.status, 'induction does not hold: not proved')} {answer.line}".strip()
    if proof.covers:
        answer = ask(proof, "cover", "cover", proof.search_depth, proof.searched_with, RTL, False, limit)
        entry["seconds"] += answer.seconds
        entry["covered"] = answer.status == "PASS"
        if not entry["covered"]:
            entry["pass"] = False
            entry["reason"] = entry["reason"] or f"within {proof.search_depth} clocks not everything covered is reached"


def _search(proof: Proof, entry: dict, limit: int) -> None:
    """Check the faults, and first that the search setup without a fault passes, unless that was proved."""
    if proof.searched_with != proof.generics:
        answer = ask(proof, "faultless", proof.method, proof.depth, proof.searched_with, RTL, True, limit)
        entry["seconds"] += answer.seconds
        if answer.status != "PASS":
            entry["pass"] = False
            entry["reason"] = entry["reason"] or f"with {dict(proof.searched_with)}: {answer.status} {answer.line}"
            return
    for k, fault in enumerate(proof.faults):
        tree = plant(fault, FOLDER / proof.name / f"rtl_{k}")
        answer = ask(proof, f"fault_{k}", "search", proof.search_depth, proof.searched_with, tree, False, limit)
        entry["seconds"] += answer.seconds
        caught = answer.status == "FAIL"
        entry["mutants"].append({"mutant": fault.says, "file": f"rtl/{fault.file}", "caught": caught})
        if not caught:
            entry["reason"] = entry["reason"] or f"does not notice '{fault.says}' ({answer.status})"
    entry["mutant_caught"] = bool(proof.faults) and all(m["caught"] for m in entry["mutants"])
