# SPDX-License-Identifier: BSD-3-Clause
"""Registers of the front ends from a drive file: one function for the table, the header and the bus."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from fluxproof.checkout import DRIVES
from fluxproof.command import main
from fluxproof.commission.session import Session
from golden_model.board_registers import board_generics, board_registers, front_end_registers
from golden_model.drive import load
from golden_model.drive_keys import DriveError
from golden_model.encoders import edge_timer
from golden_model.front_ends import Converters, Encoder
from golden_model.generated.register_names import ADDRESSES

NAMES = ("servo_24v", "hub_36v", "spindle_400v", "drone_24v")


class Bus:
    """Keeps what is written."""

    def __init__(self):
        self.written = {}

    def write(self, name, value):
        self.written[name] = value

    def read(self, name):
        return self.written.get(name)

    def now(self):
        return 0.0


@pytest.mark.parametrize("name", NAMES)
def test_header_and_commissioning_have_the_same_registers(name, tmp_path):
    path = DRIVES / f"{name}.toml"
    drive, wanted = load(path), board_registers(load(path))
    assert main(["project", str(path), "--part", "xc7z020clg484-1", "--out", str(tmp_path)]) == 0
    header = (tmp_path / "drive_registers.h").read_text()
    offsets = {int(a, 16): int(v) for a, v in re.findall(r"\{(0x[0-9A-F]+), (-?\d+)\}", header)}
    assert offsets == {ADDRESSES[n]: value for n, value in wanted.items()}
    for generic, value in board_generics(drive).items():
        assert f"#define FLUXPROOF_{generic.upper()} {value}\n" in header
    assert "-top fluxproof_board" in (tmp_path / "project.tcl").read_text()
    bus = Bus()
    Session(bus, drive).load_final()
    assert bus.written == {n: v for n, v in wanted.items() if n not in ("position_restart", "omega_given")}


def test_values_of_the_drives():
    """Worked out by hand from the files and docs/board.md."""
    servo, hub, spindle, drone = (board_registers(load(DRIVES / f"{name}.toml")) for name in NAMES)
    assert (servo["counts"], servo["code_step"], servo["code_rest"]) == (4000, 16, 1536)  # 65536 / 4000
    assert (servo["filter_clocks"], servo["clock_ratio"], servo["channel_b"], servo["channel_u_dc"]) == (10, 5, 0, 2)
    assert servo["speed_given"] == hub["speed_given"] == 1 and servo["two_sensors"] == hub["two_sensors"] == 1
    # 64e6 clocks/s; an edge is a sixth of an electrical turn; 41.9 rad/s * 15 is 1 per unit
    assert hub["k_edge"] == pytest.approx(64e6 * 1.0471975512 / (41.9 * 15) * 4096, rel=1e-6)
    assert (hub["pole_pairs"], hub["filter_clocks"], hub["conversions"], hub["xadc_channels"]) == (1, 320, 2, 3)
    assert (spindle["encoder_bits"], spindle["turn_bits"], spindle["crc_on"]) == (37, 25, 1)
    assert 100e6 / (2 * (spindle["half_period"] + 1)) <= 4e6 < 100e6 / (2 * spindle["half_period"])
    assert (spindle["mod_ratio"], spindle["oversampling"], spindle["sinc_gain"]) == (5, 64, 1 << 14)
    assert spindle["position_delay"] == drone["position_delay"] == 1 << 16 and drone["parity_on"] == 0


def test_clocks_follow_the_clock():
    """Twice the clock: every time in clocks doubles, whole numbers of them."""
    hub = load(DRIVES / "hub_36v.toml")
    fast = replace(hub, core=replace(hub.core, clock_hz=128e6))
    slow, quick = front_end_registers(hub), front_end_registers(fast)
    differing = {n for n in slow if slow[n] != quick[n]}
    assert differing == {"filter_clocks", "k_edge", "xadc_timeout"} and quick["filter_clocks"] == 640


def test_what_does_not_fit_is_named():
    servo = load(DRIVES / "servo_24v.toml")
    slow = replace(servo, encoder=Encoder("hall", filter_s=20e-6))
    with pytest.raises(DriveError, match=r"register filter_clocks from \[encoder\] filter_s.*2000 is out of range"):
        front_end_registers(slow)
    few = replace(servo.machine, rated_speed_rad_s=1.0, pole_pairs=1)
    with pytest.raises(DriveError, match=r"register k_edge from \[encoder\] counts"):
        front_end_registers(replace(servo, machine=few, encoder=Encoder("abz", counts=4)))
    with pytest.raises(DriveError, match=r"\[converters\] bits = 12 .* at least 16"):
        replace(servo, converters=Converters("spi", bits=12, skip_bits=4, clock_hz=20e6))


def test_k_edge_is_exact_enough():
    """The rounding of k_edge is below the timer's own resolution of one clock between edges."""
    for counts, pairs, omega in ((4000, 4, 1256.0), (1 << 18, 4, 2500.0), (90, 15, 628.0)):
        exact = 2 * 3.141592653589793 * pairs * 100e6 / (counts * omega)
        made = edge_timer.setting(counts, pairs, 100e6, omega) * edge_timer.K_EDGE.lsb
        assert made == pytest.approx(exact, rel=4e-5)
