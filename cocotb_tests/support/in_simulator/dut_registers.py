# SPDX-License-Identifier: BSD-3-Clause
"""Inside the simulator: traffic on the AXI4-Lite slave of register_file against its twin, every clock watched."""

from __future__ import annotations

import itertools
import os
import random

import cocotb
from cocotb.triggers import ClockCycles, FallingEdge, with_timeout
from cocotbext.axi.axil_channels import AxiLiteAWTransaction, AxiLiteWTransaction

from cocotb_tests.support.in_simulator.registers_bench import GENERICS, MAP, WRITABLE, Bench
from golden_model.fluxproof import SAMPLE_INTERVAL
from golden_model.io.register_file import to_word
from golden_model.io.register_map import DECERR, OKAY, PATIENCE, SLVERR, Kind

RUN = ("register_file", __name__, {k.upper(): v for k, v in GENERICS.items()}, {})
SEED = int(os.environ.get("FLUXPROOF_SEED", "1"))
EARLY = 12  # clocks before a sample at which a write counts before it


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def every_address_after_reset(dut):
    """Reads of every word below 0x400 and of some above, aligned or not: as the twin answers."""
    bench = await Bench(dut, SEED).start()
    far = (0x400, 0x500, 0x740, 0x840, 0xFFC, 0x001, 0x042, 0x103, 0x800, 0xC00)
    for address in (*range(0, 0x400, 4), *far):
        assert await bench.raw_fetch(address) == bench.twin.read(address), hex(address)
    bench.check_outputs()


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def every_register_at_its_ends(dut):
    """Both ends are taken and read back, one beyond is refused and changes nothing; then a value inside."""
    bench = await Bench(dut, SEED).start()
    for register in WRITABLE:
        low, high = register.port.low, register.port.high
        for value in (low, high, low - 1, high + 1, 1 << 31, bench.rng.randint(low, high)):
            word = to_word(value)
            assert await bench.write(register.address, word) == bench.twin.write(register.address, word), (
                register.name,
                value,
            )
            await FallingEdge(dut.clk)
            await FallingEdge(dut.clk)
            if register.kind is Kind.PULSE:
                bench.twin.clock()
            bench.check_outputs()
            assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name
    # All of them hold their own value still: no write went to a neighbour.
    for register in WRITABLE:
        assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def writes_that_are_no_register(dut):
    """Read-only, empty and unaligned places, and every partial strobe: refused, nothing changes."""
    bench = await Bench(dut, SEED).start()
    for address in (
        *range(0, 0x100, 4),
        0x138,
        0x1F4,
        0x200,
        0x3FC,
        0x450,
        0x850,
        0xC50,
        0x051,
        0x052,
        0x153,
    ):
        wanted = bench.twin.write(address, 1)
        assert await bench.raw_write(address, 1, 15) == wanted, hex(address)
        await ClockCycles(dut.clk, 2)
        bench.twin.clock()
    for strobe in range(15):
        assert await bench.raw_write(0x150, 3, strobe) == bench.twin.write(0x150, 3, strobe) == SLVERR
        assert await bench.raw_write(0x154 + 0x400, 3, strobe) == DECERR
    bench.check_outputs()


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def random_traffic(dut):
    """Reads and writes of anything, back-pressure on every channel, samples all the time."""
    bench = await Bench(dut, SEED).start()
    running = [cocotb.start_soon(bench.samples(1)), cocotb.start_soon(steady_reads(bench))]
    answers = []
    for count in range(300):
        if count % 100 == 0:
            bench.hold_back((0.0, 0.2, 0.5, 0.8)[count // 100 % 4])
        register = bench.rng.choice(list(MAP.values()))
        address = register.address if bench.rng.random() < 0.9 else bench.rng.randrange(0, 0x1000, 4)
        if register.kind in (Kind.PULSE, Kind.SAMPLE_PULSE):
            continue  # their own test
        if bench.rng.random() < 0.6:
            word = bench.some_word(register)
            answer = await bench.write(address, word)
            assert answer == bench.twin.write(address, word), (register.name, hex(address), word)
            answers.append(answer)
        else:
            assert await bench.fetch(address) == bench.twin.read(address), hex(address)
    bench.twin.clock()
    await FallingEdge(dut.clk)
    bench.twin.values["clear_faults"] = bench.held()["clear_faults"]
    bench.check_outputs()
    assert min(answers.count(kind) for kind in (OKAY, SLVERR, DECERR)) > 10
    for task in running:
        task.cancel()


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def answers_come_in_order(dut):
    """Writes sent without waiting for answers, and a master slow to take them: one answer each, in order."""
    bench = await Bench(dut, SEED).start()
    rng = random.Random(SEED)
    bench.master.write_if.b_channel.set_pause_generator(rng.random() < 0.9 for _ in itertools.repeat(0))
    port, wanted = bench.master.write_if, []

    async def answers():
        return [int((await port.b_channel.recv()).bresp) for _ in range(40)]

    receiving = cocotb.start_soon(answers())
    for count in range(40):
        address, word = rng.choice(((0x150, count), (0x124, 64), (0x3FC, 0), (0x154, 1 << 24)))
        await port.aw_channel.send(AxiLiteAWTransaction(awaddr=address, awprot=0))
        await port.w_channel.send(AxiLiteWTransaction(wdata=word, wstrb=15))
        wanted.append(bench.twin.write(address, word))
    assert await receiving == wanted and set(wanted) == {OKAY, SLVERR, DECERR}
    for _ in range(100):
        await FallingEdge(dut.clk)
        assert int(dut.s_axi_bvalid.value) == 0, "an answer too many"
    bench.check_outputs()


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def neither_direction_starves(dut):
    """Reads and writes both sent without a pause: they take turns."""
    bench = await Bench(dut, SEED).start()
    order = []

    async def note(kind, operation):
        await operation
        order.append(kind)

    tasks = [cocotb.start_soon(note("r", bench.fetch(0x000))) for _ in range(20)]
    tasks += [cocotb.start_soon(note("w", bench.write(0x150, k))) for k in range(20)]
    for task in tasks:
        await with_timeout(task, 10, "us")
    assert "rrr" not in "".join(order[:-2]) and "www" not in "".join(order[:-2]), "".join(order)


async def steady_reads(bench: Bench) -> None:
    """Reads in parallel to the writes, of constant words: the two directions share one state machine."""
    while True:
        name = bench.rng.choice(("identification", "version", "clock_hz", "carrier_half"))
        assert await bench.fetch(MAP[name].address) == bench.twin.read(MAP[name].address)


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def a_setting_waits_for_the_sample(dut):
    """Written in every clock of a sample, or together with its start: it counts in the first clock after it."""
    bench = await Bench(dut, SEED).start()
    held_up = []
    for number, lead in enumerate(range(-EARLY, SAMPLE_INTERVAL + 4)):
        held_up += [lead] * await written_around_a_sample(bench, MAP["kp_d"], 1000 + number, lead, SAMPLE_INTERVAL)
    assert held_up[0] > -EARLY
    # Each setting is held up by a gate of its own: in the clocks in which the write was under way as the sample came.
    for register in (r for r in WRITABLE if r.kind in (Kind.SETTING, Kind.STILL)):
        for lead in held_up[:2]:
            low, high, now = register.port.low, register.port.high, bench.twin.values[register.name]
            assert await written_around_a_sample(bench, register, high if now == low else low, lead, 12)


async def written_around_a_sample(bench: Bench, register, value: int, lead: int, busy: int) -> bool:
    """Write a setting ``lead`` clocks after sample_busy rises for ``busy`` clocks; whether the sample held it up."""
    dut = bench.dut

    async def write():
        for _ in range(EARLY + lead):
            await FallingEdge(dut.clk)
        return await bench.write(register.address, to_word(value))

    writing = cocotb.start_soon(write())
    for _ in range(EARLY):
        await FallingEdge(dut.clk)
    dut.sample_busy.value = 1
    before = bench.held()[register.name]
    for _ in range(busy):
        await FallingEdge(dut.clk)
        assert bench.held()[register.name] == before, f"{register.name} changed inside a sample"
    dut.sample_busy.value = 0
    await FallingEdge(dut.clk)
    assert await with_timeout(writing, 400, "ns") == OKAY
    assert bench.twin.write(register.address, to_word(value)) == OKAY
    bench.check_outputs()
    for _ in range(3):
        await FallingEdge(dut.clk)
    return before != value


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def safety_never_waits(dut):
    """With samples that leave no gap: commands count within some clocks, settings end in SLVERR, nothing hangs."""
    bench = await Bench(dut, SEED).start()
    dut.sample_busy.value = 1
    await FallingEdge(dut.clk)
    for name in ("enable", "telemetry_enable", "clear_trip"):
        for value in (1, 0):
            assert await with_timeout(bench.write(MAP[name].address, value), 120, "ns") == OKAY
            if name != "clear_trip":
                assert bench.held()[name] == value
    start = cocotb.utils.get_sim_time("ns")
    assert await bench.write(MAP["ki_q"].address, 77) == SLVERR
    waited = (cocotb.utils.get_sim_time("ns") - start) / 10
    assert PATIENCE <= waited <= PATIENCE + 12, waited
    assert await bench.fetch(MAP["ki_q"].address) == (OKAY, 0)
    bench.check_outputs()
    # A refusal and a read do not wait either.
    start = cocotb.utils.get_sim_time("ns")
    assert await bench.write(MAP["pole_pairs"].address, 64) == SLVERR
    assert await bench.fetch(MAP["pole_pairs"].address) == (OKAY, 1)
    assert cocotb.utils.get_sim_time("ns") - start < 240
    dut.sample_busy.value = 0
    assert await bench.write(MAP["ki_q"].address, 77) == OKAY


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def the_last_clock_of_patience(dut):
    """A sample that ends in every clock around the end of the patience: OKAY and stored, or SLVERR and never stored."""
    bench = await Bench(dut, SEED).start()
    register, answers = MAP["ki_q"], []
    for number, busy in enumerate(range(PATIENCE - 4, PATIENCE + 16)):
        dut.sample_busy.value = 1
        await FallingEdge(dut.clk)
        writing = cocotb.start_soon(bench.write(register.address, 100 + number))
        for _ in range(busy):
            await FallingEdge(dut.clk)
        dut.sample_busy.value = 0
        answers.append(await writing)
        if answers[-1] == OKAY:
            bench.twin.write(register.address, 100 + number)
        for _ in range(6):
            await FallingEdge(dut.clk)
            bench.check_outputs()
        assert await bench.fetch(register.address) == bench.twin.read(register.address), busy
    assert answers == sorted(answers) and {*answers} == {OKAY, SLVERR}


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def a_still_setting_needs_the_gates_off(dut):
    """Refused while they switch; where they begin or end in any clock of a write, waiting or not: stored and OKAY, or
    neither.
    """
    bench = await Bench(dut, SEED).start()
    still = [r for r in WRITABLE if r.kind is Kind.STILL]
    bench.inputs["running"].value = bench.twin.status["running"] = 1
    for register in (*still, MAP["theta_offset"], MAP["enable"]):
        answer = await bench.write(register.address, register.port.high)
        assert (
            answer == bench.twin.write(register.address, register.port.high) == (SLVERR if register in still else OKAY)
        )
        assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name
    bench.check_outputs()
    answers = []
    for begins, busy, lead in itertools.product((1, 0), (0, 9), range(16)):
        register = still[lead % len(still)]
        value = bench.rng.randint(register.port.low, register.port.high)
        bench.inputs["running"].value, dut.sample_busy.value = 1 - begins, int(busy > 0)
        await ClockCycles(dut.clk, 3)
        await FallingEdge(dut.clk)
        writing = cocotb.start_soon(bench.write(register.address, to_word(value)))
        for clock in range(24):
            if clock == lead:
                bench.inputs["running"].value = begins
            if clock == busy:
                dut.sample_busy.value = 0
            await FallingEdge(dut.clk)
        answers.append(await writing)
        bench.twin.status["running"] = int(answers[-1] == SLVERR)
        assert bench.twin.write(register.address, to_word(value)) == answers[-1]
        for _ in range(3):
            bench.check_outputs()
            await FallingEdge(dut.clk)
        bench.twin.status["running"] = begins
        assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name
    late, early = answers[:16], answers[32:48]  # without a sample: refused where the gates switched early enough
    assert late == sorted(late, reverse=True) and early == sorted(early) and {*late} == {*early} == {OKAY, SLVERR}


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def pulses_fall_back(dut):
    """clear_trip is one clock long; clear_faults is 1 when the next sample is taken, and 0 after it."""
    bench = await Bench(dut, SEED).start()
    for value in (1, 0):
        high = 0
        writing = cocotb.start_soon(bench.write(MAP["clear_trip"].address, value))
        for _ in range(30):
            await FallingEdge(dut.clk)
            high += int(dut.clear_trip.value)
        assert await writing == OKAY and high == value
    assert await bench.write(MAP["clear_faults"].address, 1) == OKAY
    for _ in range(100):
        await FallingEdge(dut.clk)
        assert int(dut.clear_faults_in.value) == 1
    assert await bench.fetch(MAP["clear_faults"].address) == (OKAY, 1)
    await FallingEdge(dut.clk)
    assert int(dut.clear_faults_in.value) == 1
    dut.sample_busy.value = 1
    await FallingEdge(dut.clk)
    assert int(dut.clear_faults_in.value) == 0
    assert await bench.fetch(MAP["clear_faults"].address) == (OKAY, 0)
    assert await bench.write(MAP["clear_faults"].address, 2) == SLVERR
    bench.check_outputs()


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def a_pulse_that_rises_as_a_sample_enters_waits_for_the_next(dut):
    """Written in every clock around the edge that takes a sample in: each pulse is seen by one sample, none by two."""
    bench = await Bench(dut, SEED).start()
    rose = []
    for lead in range(-2, 12):
        writing = cocotb.start_soon(bench.write(MAP["clear_faults"].address, 1))
        for _ in range(lead):
            await FallingEdge(dut.clk)
        taken = []  # what each sample saw at its edge: the clock before sample_busy is high
        for _ in range(4):
            taken.append(int(dut.clear_faults_in.value))
            await FallingEdge(dut.clk)
            before = taken[-1] == 0 and int(dut.clear_faults_in.value) == 1
            dut.sample_busy.value = 1
            for _ in range(SAMPLE_INTERVAL - 1):
                await FallingEdge(dut.clk)
            dut.sample_busy.value = 0
            rose.append(before)
            for _ in range(20):
                await FallingEdge(dut.clk)
        assert await writing == OKAY
        assert sum(taken) == 1, f"lead {lead}: samples saw {taken}"
        bench.twin.write(MAP["clear_faults"].address, 1)
        bench.twin.sample()
        bench.check_outputs()
    assert any(rose)  # at the very edge


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def status_is_what_the_core_shows(dut):
    """Random values and both ends at every status input: each word reads them, signs extended."""
    bench = await Bench(dut, SEED).start()
    shown = [(r, f) for r in MAP.values() if r.kind is Kind.STATUS for f in r.fields]
    for count in range(6):
        for _, field in shown:
            fmt = field.port.fmt
            value = (fmt.lo, fmt.hi, *(bench.rng.randint(fmt.lo, fmt.hi) for _ in range(4)))[count]
            bench.twin.status[field.name] = value
            bench.inputs[field.name].value = value
        await FallingEdge(dut.clk)
        for name in dict.fromkeys(r.name for r, _ in shown):
            assert await bench.fetch(MAP[name].address) == bench.twin.read(MAP[name].address), name


@cocotb.test(timeout_time=500, timeout_unit="us")  # a bus that hangs
async def reset_in_mid_transfer(dut):
    """rst of one clock or two in every phase of transfers: reset values, no answer left over, all works after it."""
    bench = await Bench(dut, SEED).start()
    bench.hold_back(0.3)
    for count in range(60):
        for register in bench.rng.sample(WRITABLE, 3):
            await bench.write(register.address, register.port.high)
        dut.sample_busy.value = count % 3 == 0
        for operation in (bench.write(0x150, 5), bench.fetch(0x150), bench.write(0x15C, 9)):
            cocotb.start_soon(operation)
        for _ in range(count % 20 + 1):
            await FallingEdge(dut.clk)
        dut.rst.value = 1
        dut.sample_busy.value = 0
        for _ in range(1 + count % 2):
            await FallingEdge(dut.clk)
        for name in ("awready", "wready", "arready", "bvalid", "rvalid"):
            assert int(getattr(dut, f"s_axi_{name}").value) == 0, name
        bench.twin.reset()
        bench.check_outputs()
        dut.rst.value = 0
        for _ in range(4):
            await FallingEdge(dut.clk)
            bench.check_outputs()  # nothing of the transfer was left to be stored
        for register in bench.rng.sample(WRITABLE, 2):
            assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name
            value = bench.rng.randint(register.port.low, register.port.high)
            assert await bench.write(register.address, to_word(value)) == OKAY
            if register.kind not in (Kind.PULSE, Kind.SAMPLE_PULSE):
                bench.twin.write(register.address, to_word(value))
                assert await bench.fetch(register.address) == bench.twin.read(register.address), register.name
