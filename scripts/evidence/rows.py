# SPDX-License-Identifier: BSD-3-Clause
"""Which row of docs/evidence.md follows from which result, one function each.

A function takes the parsed result and returns the text of the row's figure, or None if the result lacks it (a run with
a selection).  A new row is a line in docs/evidence.md and a function here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Row(NamedTuple):
    """claim: how the row of docs/evidence.md begins; result: file in build/; figure: its text from the result."""

    claim: str
    result: str
    figure: Callable[[dict], str | None]


ROWS: list[Row] = []


def row(claim: str, result: str):
    """Register a function as the figure of the row that begins with ``claim``."""

    def register(figure):
        ROWS.append(Row(claim, result, figure))
        return figure

    return register


def measured(rows: list[dict], name: str) -> dict | None:
    """The entry of a study whose figure is ``name``."""
    return next((r for r in rows if r.get("figure", r.get("experiment")) == name), None)


def counted(figure: dict) -> str:
    """A rate as people read it, "19 of 20"."""
    return f"{figure['k']} of {figure['n']}"


@row("raw sample to duties", "timeline.json")
def latency(result):
    return f"{result['sample_to_duty_clocks']} clocks (paper 001: about 400)"


@row("closed loop at 200 MHz / 10 kHz", "demo/summary.json")
def fig9(result):
    periods, clocks = result["periods_compared"], 2 * result["carrier_half_clocks"]
    return f"{periods:,} periods, {periods * clocks / 1e6:.0f} million clocks, {result['differences']:,} differences"


@row("the same scenario on the VHDL itself in GHDL", "demo/summary.json")
def fig9_in_ghdl(result):
    return f"{result['ghdl_periods']:,} periods, {result['differences']:,} differences"


@row("a real recording (EMRAX 228) through the RTL", "demo/summary.json")
def recording(result):
    found = result["recording"]
    return (
        None if "skipped" in found else f"{found['samples_compared']:,} samples, {found['differences']:,} differences"
    )


@row("from A/B/Z edges and SPI lines to gates", "studies/board.json")
def board(result):
    found = measured(result, "closed loop in Verilator, start from standstill, 2,000 periods")
    return found and f"2,000 periods from standstill, {found['ours']} differences"


@row("drive files with their own front ends", "studies/board.json")
def drive_files(result):
    found = [r for r in result if r["figure"].endswith("closed loop of its pins, 400 periods")]
    return f"400 periods each, {sum(r['ours'] for r in found)} differences" if found else None


@row("properties proved", "prove/result.json")
def proved(result):
    caught, planted = (sum(f(e["mutants"]) for e in result) for f in (lambda m: sum(x["caught"] for x in m), len))
    seconds = sum(e["seconds"] for e in result)
    good = sum(e["pass"] for e in result)
    return f"{good} of {len(result)} proved, {caught} of {planted} faults noticed, {seconds:.0f} s of solver time"


@row("faults drawn at random", "mutate/result.json")
def mutants(result):
    known = result["mutants"] - result["equivalent"]
    share = 100.0 * result["killed"] / max(1, known)
    left = len(result["survivors"])
    drawn = f"{result['mutants']:,} drawn, {result['equivalent']} proved equivalent"
    return f"{drawn}: of the others {share:.1f} % noticed, {left} left"


@row("sensors, bus, strobes and registers that fail", "faults/result.json")
def faults(result):
    writes = result["register_writes"]
    slowest = max((r["clocks_to_off"] for r in result["cases"] if r["clocks_to_off"] is not None), default=0)
    return f"{len(result['cases'])} faults, {writes['writes']} register writes: gates off in {slowest} clocks"


@row("commissioning over the registers", "studies/board.json")
def commissioning(result):
    def of(name):
        return measured(result, f"commissioning: {name}")

    accepted, wrong = of("motors accepted"), of("accepted wrong results")
    refused = of("faults refused with their reason")
    errors = {n: of(f"{n}, largest error") for n in ("encoder angle", "R", "L_d", "L_q", "psi")}
    if not (accepted and wrong and refused and all(errors.values())):
        return None
    sizes = ", ".join(f"{name} {e['ours']:g} {e['unit']}" for name, e in errors.items())
    faults = refused["target"].split(" of ")[-1]
    return (
        f"{accepted['ours']} accepted, {wrong['ours'] or 'none'} wrong: {sizes} at worst; "
        f"{refused['ours']} of {faults} faults of wiring and load refused by name"
    )


@row("flux linkage with all magnetic parameters 30 % wrong", "papers/flux.json")
def flux_error(result):
    def worst(figure, equation):
        found = [measured(result, f"Fig. {figure}: steady error of eq. ({equation}), {axis} axis") for axis in "dq"]
        return max(abs(f["ours"]) for f in found) if all(found) else None

    ours, earlier = worst(4, 17), worst(3, 16)
    return f"{ours:.3f} % of nominal left; the earlier scheme leaves {earlier:.0f} %" if ours is not None else None


@row("flux map of a measured Brusa HSM1", "papers/flux.json")
def brusa(result):
    found = measured(result, "Brusa map: worst steady error over the grid")
    return found and f"within {found['ours']:.2g} % over 30 points"


@row("6th harmonic of i_d at 300 rpm", "papers/vsi.json")
def sixth(result):
    raw = measured(result, "Figs. 6-8: 6th of i_d without compensation")
    clean = measured(result, "Figs. 6-8: 6th of i_d, times less with compensation")
    return raw and clean and f"{raw['ours']:.0f} mA before, {clean['ours']:.0f} times less after"


def blind(generator: str):
    """The generator's entry of build/blind/result.json, if its last run had one."""

    def take(result):
        return result.get("generators", {}).get(generator)

    return take


def rates(entry: dict) -> str:
    """Singles, pairs and triples of a generator's run."""
    f = entry["figures"]
    names = (("singles", "single_named_right"), ("pairs", "pairs_exactly_right"), ("triples", "triples_exactly_right"))
    return ", ".join(f"{word} {counted(f[name])}" for word, name in names)


def errors(entry: dict) -> str:
    """False names, false alarms and unknown physics of a generator's run."""
    f = entry["figures"]
    return (
        f"false names in {counted(f['confidently_wrong'])} cases, false alarms in {counted(f['false_alarm_healthy'])} "
        f"healthy drives, unknown physics recognised {counted(f['unknown_recognised'])}"
    )


@row("why a recording differs: own generator", "blind/result.json")
def own(result):
    entry = blind("own")(result)
    return entry and f"seed {entry['seed']}, {entry['cases_total']} cases: {rates(entry)}"


@row("the same: errors", "blind/result.json")
def own_errors(result):
    entry = blind("own")(result)
    return entry and errors(entry)


@row("the same on two simulators of other people", "blind/result.json")
def strangers(result):
    found = [(name, blind(name)(result)) for name in ("gem", "motulator")]
    parts = [f"{name}, seed {e['seed']}: {rates(e)}; {errors(e)}" for name, e in found if e]
    return ". ".join(parts) if len(parts) == len(found) else None


@row("the same on a third simulator", "blind/result.json")
def sealed(result):
    entry = blind("sealed")(result)
    return entry and f"seed {entry['seed']}: {rates(entry)}; {errors(entry)}"


@row("a million rows diagnosed", "bench/diagnose.json")
def million(result):
    runs = [r for r in result["runs"] if r["rows"] == 1_000_000]
    if not runs:
        return None
    slowest = max(runs, key=lambda r: r["seconds"])
    memory = max(r["peak_memory_mb"] for r in runs) / 1000
    return f"{slowest['seconds']:.1f} s ({slowest['format']}), {memory:.1f} GB"


@row("golden model, whole controller", "bench/golden.json")
def golden(result):
    controller, loop = result["controller_periods_per_s"], result["closed_loop_periods_per_s"]
    return f"{controller / 1e6:.1f} million and {loop / 1e3:.0f} thousand periods/s"
