# SPDX-License-Identifier: BSD-3-Clause
"""Inside the simulator: the AXI top spins the motor over its registers, everything compared with the golden model."""

from __future__ import annotations

import json
import os

import cocotb
import numpy as np
from cocotb.triggers import ClockCycles, Timer, with_timeout

from cocotb_tests.support.in_simulator.axi_device import CLOCK_NS, AxiDevice
from fluxproof.cosim.block_bench import read
from fluxproof.cosim.closed_loop import cosimulate
from fluxproof.cosim.inside import handle_of
from fluxproof.cosim.scenarios import scenario
from golden_model import drive as drives
from golden_model.fluxproof import Observed, Sample
from golden_model.io import register_map, telemetry_words
from golden_model.io.telemetry_words import COUNT
from golden_model.registers import registers
from scripts.registers.rdl import version_word

POLLED = ("omega_me", "i_d", "i_q", "u_dc", "theta_me", "torque", "psi_m", "v_dead", "flux_faults")


def motion(drive):
    """20 ms: from rest to 400 rpm, a load, towards -400 rpm; gains change on the way; enabled in the fourth period."""
    return scenario(
        drive,
        0.02,
        rpm={0.0: 400, 0.014: -400},
        load={0.007: 2.0},
        off=((0.0, 0.0003),),
        changes={0.008: {"speed_kp": 90000}, 0.01: {"l_q": 500000, "lambda_mg": 20000}},
    )


class Watched(AxiDevice):
    """Also polls the status registers now and then and stops the stream's sink for a while."""

    def __init__(self, dut, plan):
        super().__init__(dut, plan)
        self.polled = 0
        self.samples: list[tuple[dict[str, int], int]] = []

    async def period(self, inputs, enable):
        period = await super().period(inputs, enable)
        self.samples.append((inputs, period.running))
        self.stream.pause = 100 <= self.number < 150
        return period

    async def after_sample(self):
        if self.number % 13 == 12:  # more do not fit between two samples
            for name in (POLLED * 2)[self.polled % len(POLLED) :][:3]:
                got, wanted = await self.read_signed(name), read_core(self.dut, name)
                assert got == wanted, f"register {name} says {got}, the core {wanted}"
                self.polled += 1


def read_core(dut, name: str) -> int:
    """A value of the core, past the bus."""
    fields = register_map.observables()
    return read(handle_of(dut.core, name), bool(fields[name].fmt.signed))


async def check_identity(device: AxiDevice, config, clock_hz: int) -> None:
    """The registers that software checks first."""
    assert (await device.read("identification")).to_bytes(4, "big") == b"FLUX"
    version = await device.read("version")
    assert version == version_word(), f"version {version:#x}"
    for name, value in {**config._asdict(), "clock_hz": clock_hz}.items():
        assert await device.read(name) == value, name


def packets(device: AxiDevice) -> list[list[int]]:
    """The words of complete packets from the stream."""
    found = []
    while not device.stream.empty():
        frame = device.stream.recv_nowait()
        data = bytes(frame.tdata)
        found.append([int.from_bytes(data[k : k + 4], "little") for k in range(0, len(data), 4)])
    return found


def check_stream(device: Watched, observed, dropped: int) -> int:
    """Each packet equals the golden words of the sample that it names; returns how many there were."""
    found = packets(device)
    numbers = [packet[1] for packet in found]
    assert numbers == sorted(set(numbers)), "packets out of order"
    for packet in found:
        assert len(packet) == COUNT, f"packet of {len(packet)} words"
        inputs, run = device.samples[packet[1]]
        sample = Sample(*inputs.values(), run)._asdict()
        golden = dict(zip(Observed._fields, observed[packet[1]], strict=True))
        wanted = list(telemetry_words.pack(packet[1], {**golden, **sample}))
        assert packet == wanted, f"sample {packet[1]}: {packet} instead of {wanted}"
    assert dropped == len(device.samples) - len(found) > 0, f"{dropped} dropped, {len(found)} came"
    return len(found)


async def gates_on(dut) -> None:
    while not read(dut.gate_low, False) and not read(dut.gate_high, False):
        await ClockCycles(dut.aclk, 1)


async def check_trip(device: AxiDevice) -> dict[str, int]:
    """A pulse of a nanosecond on the pin: gates off without a clock, latched, reported, on again only by clear_trip."""
    dut = device.dut
    await with_timeout(gates_on(dut), 2 * CLOCK_NS * int(os.environ["FLUXPROOF_CARRIER_HALF"]), "ns")
    await Timer(3, "ns")
    dut.trip.value = 1
    await Timer(1, "ns")
    dut.trip.value = 0
    assert (read(dut.gate_high, False), read(dut.gate_low, False)) == (0, 0)
    half = await device.read("carrier_half")
    for _ in range(6 * half):
        await ClockCycles(dut.aclk, 1)
        assert (read(dut.gate_high, False), read(dut.gate_low, False)) == (0, 0), "gates on after a trip"
    assert read(dut.irq, False) == 1
    flags = await device.read("flags")
    assert flags & 3 == 2, f"flags {flags:#x}: running or not tripped"
    after_trip = {"first_fault": await device.read("first_fault")}
    # The watchdog has run out meanwhile: a sample first, then forget, then the gates may come again.
    dut.sample_valid.value = 1
    await ClockCycles(dut.aclk, 1)
    dut.sample_valid.value = 0
    await device.write("enable", 0)
    await device.write("clear_trip", 1)
    await ClockCycles(dut.aclk, 4)
    assert read(dut.irq, False) == 1 and await device.read("irq_cause") & 9 == 9, "a trip, and the gates went off"
    await device.write("irq_clear", 15)
    await ClockCycles(dut.aclk, 4)
    assert await device.read("irq_cause") == 0
    assert read(dut.irq, False) == 0 and await device.read("flags") & 2 == 0
    await device.write("enable", 1)
    for _ in range(4 * half):
        await ClockCycles(dut.aclk, 1)
        if read(dut.gate_high, False) or read(dut.gate_low, False):
            return after_trip
    raise AssertionError("no gate came on after clear_trip and enable")


@cocotb.test()
async def over_the_registers(dut):
    drive = drives.load(os.environ["FLUXPROOF_DRIVE"])
    drive = drives.with_carrier(drive, int(os.environ["FLUXPROOF_CARRIER_HALF"]))
    register_set = registers(drive)
    plan = motion(drive)
    device = Watched(dut, plan)
    result = await cosimulate(device, drive, register_set, plan)
    np.savez("result.npz", omega_m=result.plant["omega_m"], i_q=result.observed["i_q"])
    assert result.differences == 0, result.first_difference
    rows = np.stack([result.observed[name] for name in Observed._fields], axis=1).tolist()
    dropped = await device.read("telemetry_dropped")
    await ClockCycles(dut.aclk, 2 * COUNT)  # the last packet; the watchdog leaves no time for more
    sent = check_stream(device, rows, dropped)
    after_trip = await check_trip(device)
    await check_identity(device, register_set.config, int(os.environ["FLUXPROOF_CLOCK_HZ"]))
    summary = {
        "periods": result.periods_compared,
        "packets": sent,
        "dropped": dropped,
        "polled": device.polled,
        "gate_edges": len(result.gate_edges),
        **after_trip,
    }
    with open("summary.json", "w") as stream:
        json.dump(summary, stream)
