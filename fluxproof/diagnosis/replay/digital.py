# SPDX-License-Identifier: BSD-3-Clause
"""The digital part of a diagnosis: do the core's outputs equal those of its golden model?

A telemetry dump contains the inputs and outputs of the core.  The golden model is replayed over the samples and every
recorded output compared with ``==``.  If all bits are equal, the difference between recording and simulation is
physical.  If not, the result is the first sample with a difference, and in it the first block in data-flow order, with
signal and bit.  If one wrong bit of a register, a raw sample or the start state explains the recording, the result
names that bit and the block it acts in, even if the core does not output that block's signals.

A stretch with an unknown start state (the recording begins while the drive runs, or samples were lost) is replayed from
the best known state, and counts from the row after which everything agrees to its end.  If there is none, only
the blocks without state are checked (digital_local.py), since the state of the regulators was not recorded.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Recording
from fluxproof.diagnosis.ground.result import Digital
from fluxproof.diagnosis.replay.cause import Cause, find_cause, golden_value, lowest_bit, where_they_part
from fluxproof.diagnosis.replay.chain import Run, run_of
from fluxproof.diagnosis.replay.flow import OWNER, block_name, first_in_flow, hidden_before
from fluxproof.diagnosis.replay.local import check_rows, checkable
from golden_model import fluxproof
from golden_model.fluxproof import OBSERVED
from golden_model.io import sample_latch
from golden_model.kernel import CACHE_DIR
from golden_model.units import unit

CONVERGED = 1000  # rows that must agree to the end before a run-in is accepted
KINDS = {
    "register": "register {name} in the recording's header: the core behaved as with {acted} instead of {found}",
    "sample": "raw sample {name}: the core behaved as with {acted} instead of {found}",
    "start_state": "start state {name}: the core behaved as with {acted} instead of {found}",
    "record": "only this one value of the record differs; all that is computed from it, and all later rows, agree",
}


def replay(recording: Recording) -> tuple[Digital, list[str]]:
    """(result.Digital, sentences for the report) of a recording with the core's inputs and outputs.

    Uses ``recording.meta`` as telemetry.read_dump makes it: ``registers``, ``config`` and ``samples`` at least;
    ``observed``, or the duty columns as the core's compare values; ``start``, ``first_state``, ``gaps``, ``table``,
    ``changes``.
    ``first_difference`` has block, instance, sample (row), counter, signal, bit, recorded, golden (as hexadecimal
    and, with unit, in SI), differing (all signals of that row), hidden (blocks upstream without recorded outputs) and
    cause (or None).  ``checked`` is False if no sample of the whole core could be compared; ``samples`` is the
    number of compared ones.
    """
    meta = recording.meta
    missing = [name for name in ("registers", "config", "samples") if meta.get(name) is None]
    if missing:
        return Digital(), [
            f"The digital part was not checked: the recording has no {', no '.join(missing)} of the core."
        ]
    lacking = [name for name in fluxproof.Registers._fields if name not in meta["registers"]]
    if lacking:
        return Digital(), [f"The digital part was not checked: register {lacking[0]} is not in the recording."]
    if meta["config"].get("references", 0) and meta["registers"]["use_table"] and meta.get("table") is None:
        return Digital(), ["The digital part was not checked: the recording does not hold the core's torque table."]
    told = meta.get("changes") is not None
    if meta["config"].get("position_loop", 0) and meta["registers"]["position_mode"] and not told:
        return Digital(), [
            "The digital part was not checked: the recording does not hold the targets of position mode."
        ]
    if _geared(meta):
        return Digital(), [
            "The digital part was not checked: the recording does not hold the codes of the gear's master."
        ]
    if meta["config"].get("modes", 0) and meta["registers"]["voltage_mode"] and not told:
        return Digital(), [
            "The digital part was not checked: the recording does not hold the voltages of voltage mode."
        ]
    observed = meta.get("observed") or _duties(recording, meta["config"])
    if not observed:
        return Digital(), [
            "The digital part was not checked: the recording has no output of the core, not even duties."
        ]
    run = run_of(
        meta["samples"], observed, meta["registers"], meta["config"], meta.get("table"), meta.get("changes") or ()
    )
    notes = [f"The dump's header was changed after it was written: {what}." for what in meta.get("altered", [])]
    misfit = _not_of_its_format(run)
    if misfit is not None:
        return _result(run, recording, *misfit), notes
    return _stretches(run, recording, notes)


def _geared(meta) -> bool:
    """Whether the gear acts on codes that a front end gave: only a host that wrote them left them in the changes."""
    told = [new for _, new in meta.get("changes") or ()]
    on, by_position = (
        any(values.get(name, 0) for values in (meta["registers"], *told)) for name in ("gear_on", "position_mode")
    )
    written = any("gear_code" in values for values in told)
    return bool(meta["config"].get("gearing", 0) and on and by_position and not written)


def _duties(recording: Recording, config) -> dict:
    """Compare values from duty columns, if these are whole clock periods."""
    if not recording.has("d_a", "d_b", "d_c"):
        return {}
    clocks = {f"compare_{x}": recording[f"d_{x}"] * config["carrier_half"] for x in "abc"}
    whole = all(np.abs(v - np.round(v)).max() < 1e-3 for v in clocks.values())
    return {name: np.round(v).astype(np.int64) for name, v in clocks.items()} if whole else {}


def _not_of_its_format(run: Run):
    """A raw value outside its port's format: (row, instance, signal, golden, cause, names) or None."""
    for k, port in enumerate(sample_latch.BLOCK.outputs):
        name = fluxproof.Sample._fields[k]
        size = sample_latch.BLOCK.width_from.get(port.name)
        fmt = size({"ADC_BITS": run.config.adc_bits, "POSITION_BITS": run.config.position_bits}) if size else port.fmt
        wrong = np.flatnonzero((run.samples[:, k] < fmt.lo) | (run.samples[:, k] > fmt.hi))
        if len(wrong):
            row = int(wrong[0])
            value = int(run.samples[row, k])
            acted = value & ((1 << fmt.width) - 1)
            return (
                row,
                "latch",
                name,
                acted,
                {"kind": "sample", "name": name, "says": f"{value} is not a value of {fmt}"},
                [name],
            )
    return None


def _stretches(run: Run, recording: Recording, notes: list[str]) -> tuple[Digital, list[str]]:
    """Check every stretch between lost samples; the first difference in time is the result."""
    meta, n = recording.meta, len(run.samples)
    gaps = meta.get("gaps", [])
    ends = [*(row for row, _ in gaps), n]
    state, known = meta.get("first_state"), meta.get("start", "unknown")
    checked = run_in = local = 0
    for number, (start, stop) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
        begin = state if state is not None else fluxproof.State()
        certain = number == 0 and known in ("reset", "state")
        row, before, names = run.until_different(begin, start, stop)
        if row == stop:
            checked, state = checked + stop - start, before
            continue
        if certain:
            return _differs(run, recording, begin, start, stop, row, before, names, known == "state"), notes
        fault, names, golden = check_rows(run, start, stop)
        if fault < stop:
            signal = first_in_flow(names)
            return _result(run, recording, fault, OWNER[signal], signal, golden[signal], None, names), notes
        agreed = _agrees_from(run, begin, start, stop)
        if stop - agreed >= CONVERGED:
            run_in, checked = run_in + agreed - start, checked + stop - agreed
            state = run.state_at(begin, start, stop)
            continue
        local, state = local + stop - start, None
    digital = Digital(checked=checked > 0, samples=checked)
    return digital, notes + _sentences(run, gaps, known, checked, run_in, local)


def _agrees_from(run: Run, state, start, stop) -> int:
    """The row from which a replay with an assumed state agrees to the end."""
    _, last = run.differences(state, start, stop)
    return last + 1


def _differs(run, recording, state, start, stop, row, before, names, whole_state) -> Digital:
    """The first difference of a stretch with a known start state."""
    signal = first_in_flow(names)
    golden, instance = golden_value(run, before, row, signal), OWNER[signal]
    cause, first = find_cause(run, state, start, stop, row, names, whole_state)
    shown = None
    if cause is not None:
        shown = _cause_mapping(cause, stop)
        if cause.kind != "record":
            parted, instance = where_they_part(run, cause, run.state_at(state, start, first), first, row)
            shown["row"] = parted
    return _result(run, recording, row, instance or OWNER[signal], signal, golden, shown, names)


def _cause_mapping(cause: Cause, stop) -> dict:
    """A cause as a mapping for diagnosis.json."""
    words = {
        "found": f"{cause.found} ({hexadecimal(cause.found)})",
        "acted": f"{cause.acted} ({hexadecimal(cause.acted)})",
    }
    says = KINDS[cause.kind].format(name=cause.name, **words)
    if cause.rows < stop:
        says += f", up to row {cause.rows - 1}; then something else differs"
    return {
        "kind": cause.kind,
        "name": cause.name,
        "bit": cause.bit,
        "bits": list(cause.bits or (cause.bit,)),  # any one of them explains equally many rows
        "recorded": cause.found,
        "behaved_as": cause.acted,
        "explains_rows_to": cause.rows,
        "says": says,
    }


def _result(run, recording, row, instance, signal, golden, cause, names) -> Digital:
    """A difference in the form of diagnosis.json."""
    is_input = signal in fluxproof.Sample._fields
    found = int(run.samples[row, fluxproof.Sample._fields.index(signal)] if is_input else _recorded(run, row, signal))
    scale = recording.meta.get("scales", {}).get(signal, 1.0)
    physical = "code" if is_input else unit(signal)
    counter = recording.meta.get("counter")
    difference = {
        "block": block_name(instance),
        "instance": instance,
        "sample": row,
        "counter": int(counter[row]) if counter is not None else row,
        "signal": signal,
        "format": "" if is_input else str(OBSERVED[signal].fmt),
        "bit": lowest_bit(found, golden),
        "recorded": hexadecimal(found),
        "golden": hexadecimal(golden),
        "recorded_si": found * scale,
        "golden_si": golden * scale,
        "unit": physical,
        "differing": sorted(names),
        "hidden": [] if is_input or cause else hidden_before(instance, run.names, run.config),
        "cause": cause,
    }
    model = recording.meta.get("telemetry", {}).get("core", {}).get("golden_model")
    if model not in (None, CACHE_DIR.name):
        difference["other_golden_model"] = f"the dump was made with golden model {model}, this is {CACHE_DIR.name}"
    return Digital(checked=True, samples=row, first_difference=difference)


def _recorded(run, row, signal):
    return run.recorded[row, run.names.index(signal)]


def hexadecimal(value: int) -> str:
    """An integer as hexadecimal, in 32-bit two's complement if negative."""
    return f"0x{value & 0xFFFFFFFF:x}"


def _sentences(run, gaps, known, checked, run_in, local) -> list[str]:
    """Sentences on what was compared and what was not."""
    said = []
    if gaps:
        lost = sum(count for _, count in gaps)
        said.append(f"{lost} samples are missing in {len(gaps)} places, the first before row {gaps[0][0]}.")
    if checked:
        said.append(f"The golden model agrees in every bit: {checked} samples with {len(run.names)} signals each.")
    if checked:
        said.append("The gate signals are not recorded: they and the register dead_time were not checked.")
    if run_in:
        said.append(f"{run_in} samples were used as run-in, since the core's state before them is not recorded.")
    if local:
        signals = checkable(run.names)
        why = "its start state is not recorded" if known == "unknown" else "samples before it are missing"
        said.append(
            f"{local} samples could not be replayed, {why}; only blocks without state were compared, "
            f"and they are equal: {', '.join(signals)}. Regulators and estimators were not checked there."
        )
    return said
