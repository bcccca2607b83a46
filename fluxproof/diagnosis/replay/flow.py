# SPDX-License-Identifier: BSD-3-Clause
"""Which block drives which signal, in data-flow order, and the outputs of every block of the core in one sample.

Everything is derived from fluxproof.WIRING, the declared ports of the blocks and fluxproof.step.
"""

from __future__ import annotations

import types
from collections import defaultdict

from golden_model import estimation, fluxproof
from golden_model.control.reference_table import BLANK
from golden_model.fluxproof import outputs_of


def _first_results(instance: str) -> int:
    """Clock at which an instance has its first results; its followers may start there."""
    block = fluxproof.WIRING[instance][0].BLOCK
    return fluxproof.schedule()[instance][1] - (block.ahead if block.soon else 0)


def _ordered() -> list[str]:
    """The instances, each behind those that it waits for; of several that could come next, the one with results first.

    A block may give its first results before its last input is there, so these alone are no order of cause and effect.
    """
    waiting, order = dict(fluxproof.WIRING), []
    while waiting:
        free = [name for name, (_, awaited) in waiting.items() if not set(awaited) & set(waiting)]
        order.append(min(free, key=_first_results))
        del waiting[order[-1]]
    return order


ORDER = _ordered()
OWNER = {
    signal: instance
    for instance in fluxproof.WIRING
    for signal in outputs_of(instance)
    if signal in fluxproof.Observed._fields
}


def block_name(instance: str) -> str:
    """The block behind an instance of the top."""
    return fluxproof.WIRING[instance][0].BLOCK.name


def first_in_flow(signals) -> str:
    """The signal whose block is ready first; ports in the order of the top."""
    fields = fluxproof.Observed._fields
    return min(signals, key=lambda s: (ORDER.index(OWNER[s]), fields.index(s)))


def _awaited(name: str, follower: str) -> list[str]:
    """The instances that an instance waits for before it has all outputs that ``follower`` uses.

    A follower that starts before the late outputs are ready uses only those that come with out_soon, which do not
    depend on the late inputs of the instance.
    """
    block = fluxproof.WIRING[name][0].BLOCK
    taken_late = max(p.late for p in fluxproof.WIRING[follower][0].BLOCK.inputs)
    first_only = fluxproof.EARLY.get((follower, name), 0) > taken_late
    return [
        source
        for source in fluxproof.WIRING[name][1]
        if not first_only or fluxproof.EARLY.get((name, source), 0) < block.latency - block.ahead
    ]


def hidden_before(instance: str, shown, config: fluxproof.Config) -> list[str]:
    """Instances upstream of ``instance`` whose outputs are not among the signals ``shown``, in data-flow order.

    A fault in one of them first appears at ``instance`` if every signal between them is hidden.  What the generics of
    ``config`` leave out is not upstream of anything.
    """
    absent = {name for generic, part in fluxproof.PARTS.items() if not getattr(config, generic) for name in part}
    seen, waiting = set(), [(name, instance) for name in fluxproof.WIRING[instance][1]]
    while waiting:
        name, follower = waiting.pop()
        hidden = [s for s in outputs_of(name) if s not in shown]
        if (name, follower) in seen or not hidden or name == "latch" or name in absent:
            continue
        seen.add((name, follower))
        if len(hidden) == len(outputs_of(name)):
            waiting += [(source, name) for source in _awaited(name, follower)]
    return sorted({name for name, _ in seen}, key=ORDER.index)


class _Listener:
    """Replaces a block's module inside fluxproof.step and records the result of each call."""

    def __init__(self, module, notes):
        self._module, self._notes = module, notes

    def __getattr__(self, name):
        return getattr(self._module, name)

    def step(self, *args):
        result = self._module.step(*args)
        self._notes[self._module].append(result[1] if self._module.BLOCK.state is not None else result)
        return result


def trace(state, sample, registers, config, of_speed=None, table=BLANK) -> dict[str, tuple]:
    """{instance: its outputs} of one sample, hidden ones included; ``latch`` is the sample itself.

    The top's step runs as plain Python with listeners instead of the blocks.  The calls of a block that is used
    several times are in the order of WIRING.  An instance that the generics leave out has no outputs.
    ``of_speed``: fluxproof.Given of the sample; the registers' if none; ``table``: the words of the torque table.
    """
    notes = defaultdict(list)
    estimators = types.SimpleNamespace(**vars(estimation))
    for name in ("for_control", "step"):
        setattr(estimators, name, _overheard(getattr(estimation, name).py_func, notes))
    of_speed = of_speed or fluxproof.given_by_registers.py_func(registers)
    step = _overheard(fluxproof.step_table.py_func, notes, estimation=estimators)
    step(state, sample, registers, config, of_speed, table)
    said = {}
    for instance, (module, _) in fluxproof.WIRING.items():
        given = notes[module].pop(0) if notes[module] else ()
        said[instance] = tuple(sample) if instance == "latch" else tuple(map(int, given))
    return said


def _overheard(function, notes, **others):
    """The function as plain Python, with listeners instead of the blocks; ``others``: further names it sees."""
    modules = {module for module, _ in fluxproof.WIRING.values()}
    names = dict(function.__globals__) | others
    names |= {k: _Listener(v, notes) for k, v in names.items() if isinstance(v, types.ModuleType) and v in modules}
    return types.FunctionType(function.__code__, names)


def parted(a: dict[str, tuple], b: dict[str, tuple]) -> list[str]:
    """Instances whose outputs differ between two traces, in data-flow order."""
    return [name for name in ORDER if a[name] != b[name]]
