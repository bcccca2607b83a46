"""The router is asked for less until it gets there; a made-up one that reaches some clock and else goes on for ever."""

from __future__ import annotations

import json
import sys

import pytest

from scripts.synth import chip, ecp5
from scripts.synth.routed import Slowest
from scripts.synth.yosys import SynthesisFailed

ROUTER = """#!{python}
import itertools, json
settings = json.load(open("wanted.json"))["modules"]["top"]["settings"]
if "{fails}":
    print("no such option")
    raise SystemExit(1)
asked = float(settings["target_freq"]) / 1e6 if "router/tmg_ripup" in settings else 0.0
for number in itertools.count(1) if asked > {reached} else (1, 2):
    print(f"Info:     iter={{number}} wires=3 overused=0", flush=True)
json.dump({{"fmax": {{"clk": {{"achieved": asked or {plain}}}}}}}, open("report.json", "w"))
"""


ESTIMATE = 10.0  # ns, of the slowest path after refining
SHARES = (0.93, 0.89, 0.85)  # of it, what the router is asked for


def fmax_of(folder) -> float:
    return json.loads((folder / "report.json").read_text())["fmax"]["clk"]["achieved"]


def routing(tmp_path, monkeypatch, reached: float, plain: float = 80.0, fails: str = "") -> ecp5.Routing:
    router = tmp_path / "router"
    router.write_text(ROUTER.format(python=sys.executable, reached=reached, plain=plain, fails=fails))
    router.chmod(0o755)
    made = ecp5.Routing.__new__(ecp5.Routing)
    made.folder = tmp_path
    cell = {"attributes": {chip.BEL: "X3/Y3/SLICEA.K0"}, "connections": {"A": [], "F": [2]}}
    placed = {"modules": {"top": {"cells": {"c": cell}, "settings": {"target_freq": "200e6"}}}}
    for name in ("design.json", "pins.lpf"):
        (tmp_path / name).touch()

    def place(seed, folder):
        (folder / "placed.json").write_text(json.dumps(placed))

    made._place = place
    monkeypatch.setattr(ecp5, "SHARES", SHARES)
    monkeypatch.setattr(ecp5, "refine", lambda folder, seed: ESTIMATE)
    made.names = type("Names", (), {"register": staticmethod(str)})
    monkeypatch.setattr(ecp5, "tool", lambda name: str(router))
    made._slowest = lambda folder: Slowest([("c", "F")], "c", 1000 / fmax_of(folder), 1.0)
    return made


@pytest.mark.parametrize(
    ("reached", "plain", "fmax"),
    [(300, 80, 93.0), (92, 80, 89.0), (69, 80, 80.0), (69, 70, 70.0)],
)
def test_the_fastest_clock_that_is_reached(tmp_path, monkeypatch, reached, plain, fmax):
    """What is asked are shares of the estimate of 100 MHz; where none is reached nothing, which gives ``plain``."""
    assert routing(tmp_path, monkeypatch, reached, plain).route(1).fmax_mhz == pytest.approx(fmax)


def test_a_router_that_fails_is_told(tmp_path, monkeypatch):
    with pytest.raises(SynthesisFailed, match="no such option"):
        routing(tmp_path, monkeypatch, 300, fails="yes").route(1)

