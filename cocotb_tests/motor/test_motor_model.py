# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA as it is wired against its golden model, and that model against the plant."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim import sleeping
from fluxproof.hil.registers import (
    PORTS,
    ROOM,
    Thermal,
    bus_registers,
    code,
    filter_register,
    heat_registers,
    machine_of,
    motor_registers,
    motor_scale,
)
from fluxproof.plant.bus import Bus
from fluxproof.plant.pmsm import Machine
from golden_model.common.multiply_add import multiply_subtract
from golden_model.fixed import round_half_up
from golden_model.formats import FLUX, MOTOR_FLUX, MOTOR_LEG, MOTOR_VOLTAGE, PU
from golden_model.motor import motor_bus, motor_filter, motor_flux, motor_heat, motor_legs, motor_model, motor_shaft
from golden_model.motor.motor_heat import HEATING, SHARE
from golden_model.motor.motor_model import Shown
from studies.hil import closed_loop, commissioning, equal, golden, in_ghdl, residual
from studies.hil.beside_plant import HELD, OWN, beside_plant, follow
from studies.hil.drive import CLOCK_HZ, CURRENT_A, SERVO, SWITCHES, U_DC_V, ride, servo
from studies.hil.plant import ANGLE_DEG, CURRENT_PERCENT, TORQUE_PERCENT, differences


def test_motor_in_verilator():
    """Saturation, harmonics, cogging, friction, dead times, all gates off, a second start: every output, every step."""
    skip_without_ghdl5()
    done = equal.compare(3000)
    wrong = done.wrong
    assert not len(wrong), f"step {wrong[0][0]}: {Shown._fields[wrong[0][1]]} differs"
    assert (np.ptp(done.golden, axis=0) > 1000).all(), "an output that hardly moves shows nothing"
    assert not done.shoot_through.any()


@pytest.mark.slow
@pytest.mark.parametrize("filter_s", [0.0, closed_loop.FILTER_S])
def test_core_and_motor_in_one(filter_s):
    """The loop closed in the RTL alone: gates at every clock, the last sample's values, a load step in the middle."""
    skip_without_ghdl5()
    golden, rtl = closed_loop.compare(40, filter_s)
    wrong = np.flatnonzero(golden.words != rtl.words)
    assert not len(wrong), f"gates differ at clock {wrong[0]}"
    assert rtl.observed[-1] == golden.observed[-1]
    assert golden.observed[-1]["omega_me"] > 1000, "the shaft does not turn"


@pytest.mark.slow
@pytest.mark.parametrize("half", [93, 200])
@pytest.mark.parametrize("filter_s", [0.0, closed_loop.FILTER_S])
def test_core_and_motor_from_the_first_sample_on(half, filter_s):
    """The shaft is driven from the reset on, samples fall into the motor's start, at 93 one beside its last tick."""
    skip_without_ghdl5()
    of = in_ghdl.of_half(half)
    of = of._replace(motor=of.motor._replace(psi_start=of.motor.psi_m // 2))
    of = of._replace(k_filter=filter_register(of.scale, filter_s))
    golden = closed_loop.golden_run(of, 40, 1 << 40)
    rtl = closed_loop.rtl_run(of, golden, len(golden.words))
    wrong = np.flatnonzero(golden.words != rtl.words)
    assert not len(wrong), f"gates differ at clock {wrong[0]}"
    assert rtl.observed[-1] == golden.observed[-1]


@pytest.mark.slow
@pytest.mark.parametrize(("all_clocks", "exact"), [(sleeping.EVERY_CLOCK, True), (("charge", "gates", "host"), False)])
def test_nothing_changes_in_what_sleeps(monkeypatch, all_clocks, exact):
    """Every register of the core that sleeps between samples, at every clock from the reset; a watchdog must not."""
    skip_without_ghdl5()
    monkeypatch.setattr(sleeping, "EVERY_CLOCK", all_clocks)
    core = closed_loop.rtl_of(closed_loop.parts(), sleeping.with_witness)
    core.tick(60_000)
    assert (core.missed == 0) == exact and core.get("running")


def test_a_driven_shaft_stands_until_the_start_is_over():
    """No step turns it before, also none of those that the pipeline holds at a reset."""
    regs = motor_registers(motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ), SERVO, SWITCHES)
    regs, state, angles = regs._replace(hold=1, omega_set=1 << 16), motor_model.State(), []
    for _ in range(motor_model.STARTING + 8):
        inputs, tables = motor_model.Inputs(), motor_model.no_tables()
        state, shown = motor_model.step(state, inputs, regs, tables, motor_model.STEP)
        angles.append(shown.theta_m)
    assert not any(angles[: motor_model.STARTING]) and angles[-1] > 0


@pytest.mark.slow
def test_compiled_loop_is_the_clocked_one():
    """Core and motor in one compiled loop: every value of every sample as clock by clock, with a held shaft."""
    of, periods = closed_loop.parts(), 40
    turns = 100.0 * of.scale.step_s / (2 * np.pi)
    speed = code("omega_set", turns, PORTS["omega_set"].fmt)
    of = of._replace(motor=of.motor._replace(hold=1, omega_set=speed))
    clocked = closed_loop.golden_run(of, periods, 1 << 40).observed
    asked = np.array([[*closed_loop.references(of).values(), 0]] * periods, np.int64)
    _, observed = golden.record(of.hil(), asked, golden.constant(of.motor, periods))
    for k, row in enumerate(clocked):
        assert row == {name: int(values[k]) for name, values in observed.items()}, f"sample {k}"
    assert len(clocked) == periods - 1 and abs(clocked[-1]["omega_me"]) > 1000


@pytest.mark.slow
def test_commissioning_measures_the_motor_of_the_fpga():
    """All steps on core and motor as models, from a wrong file; each value beside what the motor's registers say."""
    found = commissioning.measured(commissioning.bench())
    assert len(found.said) == 8 and abs(found.angle_deg) < 0.1
    assert all(abs(found.errors[name]) < most for name, most in commissioning.TARGETS.items()), found.errors


@pytest.mark.parametrize("how", [HELD, OWN])
def test_motor_is_the_plant(how):
    """A tenth of a second of the ride with 2 us of dead time; the whole one: `make hil`."""
    drive = servo()
    off = differences(beside_plant(drive, ride(drive, 0.1), how))
    # Ramps and steps are most of so short a ride: twice what is asked of the whole.
    limits = {"current": CURRENT_PERCENT, "torque": TORQUE_PERCENT, "angle": ANGLE_DEG}
    assert all(off[name] < 2 * limit for name, limit in limits.items()), off


def test_registers_say_what_the_machine_is():
    """Each constant within a few 1e-5 of what was given; one that does not fit is refused by its name."""
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    got = machine_of(scale, motor_registers(scale, SERVO, SWITCHES), SERVO, SWITCHES)
    for name in ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb", "inertia_kgm2"):
        assert getattr(got, name) == pytest.approx(getattr(SERVO, name), rel=5e-5), name
    light = Machine(**(vars(SERVO) | {"inertia_kgm2": 1e-12}))
    with pytest.raises(ValueError, match=r"motor: k_j = .* does not fit U\(-31,56\)"):
        motor_registers(scale, light, SWITCHES)


SHORTED = 0b111000  # the lower gates of all legs
NO_EVENTS = (np.zeros(1, np.int64), np.zeros(1, np.int64), 0)


def shorted(regs: motor_model.Registers, speed: int, steps: int, state=None) -> motor_model.State:
    """The motor without drops, its terminals shorted, the shaft held at a speed."""
    regs = regs._replace(v_switch=0, v_diode=0, hold=1, omega_set=speed)
    state = motor_model.State(starting=12) if state is None else state
    return follow(state, SHORTED, NO_EVENTS, steps, 0, 0, regs, motor_model.no_tables())[0]


def test_rounding_makes_no_energy():
    """Without R the flux stays to the last bit while the rotor turns; R takes energy until the flux rests."""
    regs = motor_registers(motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ), SERVO, SWITCHES)
    speed = round(3000 / 60 * motor_model.STEP / CLOCK_HZ / PORTS["omega_set"].fmt.lsb)
    still = regs._replace(r_a=0, r_b=0, r_c=0, psi_start=regs.psi_m // 2)
    state = shorted(still, speed, 100_000)
    assert state.of_flux == (still.psi_start << motor_flux.DROP_OUT, 0) and abs(state.chain_1.i_q) > 1000
    state, before = shorted(regs, speed, 100_000), math.inf  # the magnets drive a current, then the shaft stops
    inverse_l, small = (regs.inv_l_d, regs.inv_l_q), 2  # LSB of a current at rest
    for _ in range(3000):
        state = shorted(regs, 0, 100, state)
        i_d, i_q = state.chain_1.i_d, state.chain_1.i_q
        energy = i_d**2 / inverse_l[0] + i_q**2 / inverse_l[1]
        step = 2 * small * (abs(i_d) / inverse_l[0] + abs(i_q) / inverse_l[1]) + small**2 / min(inverse_l)
        assert energy <= before + step, "a current grows without a voltage"
        before = energy
    assert max(abs(i_d), abs(i_q)) <= small and shorted(regs, 0, 10_000, state).of_flux == state.of_flux


def test_the_bus_is_a_capacitor_with_its_source_and_its_brake_resistor():
    """Against closed forms over a millisecond: charge taken, fed through a resistance, held by a rectifier, braked."""
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    farad, source_ohm, brake_ohm, steps = 470e-6, 2.0, 5.0, round(1e-3 / scale.step_s)
    regs, time_s = bus_registers(scale, Bus(farad, source_ohm, True, brake_ohm)), steps * scale.step_s

    def after(start_v, source_v, amperes=0.0, brake=0, **changes):
        charge, now = round(amperes / scale.current_a * 2**16) * motor_model.STEP, regs._replace(**changes)
        state = motor_bus.State(scale.u_dc(start_v) << motor_bus.DROP_U)
        for _ in range(steps):
            state, (u_dc,) = motor_bus.step(state, charge, scale.u_dc(source_v), brake, 0, *now)
        return u_dc * MOTOR_VOLTAGE.lsb * scale.voltage_v

    assert after(24.0, 0.0, 2.0) == pytest.approx(24.0 - 2.0 * time_s / farad, rel=1e-3)
    fed = math.exp(-time_s / (source_ohm * farad))
    assert after(20.0, 24.0) == pytest.approx(24.0 - 4.0 * fed, rel=1e-4)
    assert after(28.0, 24.0) == pytest.approx(28.0, rel=1e-6), "a rectifier takes nothing back"
    assert after(28.0, 24.0, rectifier=0) == pytest.approx(24.0 + 4.0 * fed, rel=1e-4)
    assert after(28.0, 0.0, brake=1) == pytest.approx(28.0 * math.exp(-time_s / (brake_ohm * farad)), rel=1e-3)
    assert after(28.0, 0.0, -2.0) == pytest.approx(28.0 + 2.0 * time_s / farad, rel=1e-3)
    assert after(28.0, 21.0, 5.0, inv_c=0) == pytest.approx(21.0, rel=1e-6), "without a capacitor it is the source"


def test_the_filter_is_of_first_order_and_rests_at_the_current():
    """A step of the currents against an exponential; then rest to the last bit; no filter follows at once."""
    scale, seconds = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ), 5e-6
    k, steps, i = filter_register(scale, seconds), round(5e-6 / scale.step_s), (50_000, -30_000, 12_345)
    state, y = motor_filter.State(), ()
    for _ in range(steps):
        state, y = motor_filter.step(state, *i, k)
    share = 1.0 - (1.0 - k * motor_filter.SHARE.lsb) ** steps
    assert share == pytest.approx(1.0 - math.exp(-steps * scale.step_s / seconds), rel=1e-3)
    assert y == pytest.approx([share * x for x in i], abs=1)
    for _ in range(40 * steps):
        state, y = motor_filter.step(state, *i, k)
    assert y == i
    state, y = motor_filter.step(motor_filter.State(), *i, 0)
    assert filter_register(scale, 0.0) == 0 and y == pytest.approx(i, abs=1)
    with pytest.raises(ValueError, match=r"k_filter: 1 s is beyond 0\.0111 s"):
        filter_register(scale, 1.0)


def test_winding_and_magnets_warm_and_r_and_psi_follow():
    """Against closed forms: the rise of a first-order body by its losses, the magnets behind it, what is then hot."""
    copper = dataclasses.replace(SERVO, resistance_temp_coeff_per_k=0.0039, magnet_temp_coeff_per_k=-0.001)
    scale, body = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ), Thermal(0.05, 0.2, 0.3, ambient_c=25.0)
    own, i, bits = heat_registers(scale, copper, body), 85_000, 4
    squares = 3 * (i * PU.lsb) ** 2
    h, k_w, k_m = own.heating * HEATING.lsb, own.k_winding * SHARE.lsb, own.k_magnet * SHARE.lsb
    rise = h * 2**motor_heat.WINDOW_BITS * squares / k_w
    watts = 3 * SERVO.resistance_ohm * (i * PU.lsb * CURRENT_A) ** 2
    assert rise == pytest.approx(watts / body.winding_j_per_k * body.winding_s, rel=1e-3)

    # A window of 16 steps: as slow a body takes a 128th of the losses; R does not add to them
    rise, windows, r, psi = rise / 2 ** (motor_heat.WINDOW_BITS - bits), 600, (1 << 20, 2 << 20, 3 << 20), 6_000_000
    regs = motor_heat.Registers(*r, psi, **own._asdict())._replace(tcr_winding=0)
    state, out = motor_heat.step(motor_heat.State(), motor_heat.Inputs(0, 0, 0, 1), regs, bits)
    assert out[4] == out[5] == 25 << 6
    winding = magnet = 25.0
    for _ in range(windows):
        for _ in range(1 << bits):
            state, out = motor_heat.step(state, motor_heat.Inputs(i, i, i, 0), regs, bits)
        magnet += k_m * (winding - magnet)
        winding = 25.0 + rise - (25.0 + rise - winding) * (1.0 - k_w)
    assert winding > 30.0 and magnet > 26.0
    assert out[4] / 64 == pytest.approx(winding, abs=0.05) and out[5] / 64 == pytest.approx(magnet, abs=0.05)
    assert out[:3] == r, "without a coefficient R stays to the last bit"
    assert out[3] == pytest.approx(psi * (1 - 0.001 * (magnet - 20.0)), rel=1e-4)
    regs = regs._replace(heating=0, tcr_winding=own.tcr_winding, k_winding=0)
    for _ in range(2 << bits):
        state, out = motor_heat.step(state, motor_heat.Inputs(0, 0, 0, 0), regs, bits)
    assert out[:3] == pytest.approx([x * (1 + 0.0039 * (winding - 20.0)) for x in r], rel=1e-4)


def test_a_rounded_loss_is_a_loss():
    """R i rounded half up has the sign of i or is zero, and is at most twice as large, however small the product."""
    rng = np.random.default_rng(5)
    for _ in range(5000):
        r, i = int(rng.integers(1 << rng.integers(1, 24))), int(rng.integers(-1 << 17, 1 << 17)) >> rng.integers(17)
        minus, limited = multiply_subtract(r, i, 0, motor_flux.DROP_RI, motor_flux.LEG_W)
        assert not limited and minus * i <= 0 and abs(minus) << motor_flux.DROP_RI <= 2 * r * abs(i), (r, i)


def test_no_sum_overflows_inside_the_bounds():
    """Each equation is linear in each input, so its largest values are at the corners of the bounds."""
    leg, drop = motor_model.STEP * MOTOR_VOLTAGE.hi, motor_flux.DROP_R.hi  # any voltages, any R, any current
    for legs in itertools.product((leg, -leg), repeat=3):
        for i in itertools.product((PU.lo, PU.hi), repeat=3):
            state, _ = motor_flux.step(motor_flux.State(), *legs, *i, 0, drop, drop, drop, 0)
            s = [u - round_half_up(drop * x, motor_flux.DROP_RI) for u, x in zip(legs, i, strict=True)]
            assert state.alpha == 2 * s[0] - s[1] - s[2]
            exact = (s[1] - s[2]) * math.sqrt(3) * 2.0 ** (MOTOR_FLUX.frac_bits - 16 - MOTOR_LEG.frac_bits)
            assert abs(state.beta - exact) <= 3e-6 * abs(exact) + 1e3
    bus, room = round(ROOM / MOTOR_VOLTAGE.lsb), round(0.5 / MOTOR_VOLTAGE.lsb) - 1  # u_dc and the drop above it
    for i in (PU.lo, PU.hi):
        high, _, off = motor_legs.leg(i, bus, motor_legs.STIFFNESS.hi, room, room)
        assert {high, off} <= {bus - room, bus + room, -room}
    one, flux = 1 << PU.frac_bits, round(ROOM / FLUX.lsb)
    for turn_d, turn_q, i_d in itertools.product((flux, -flux), (0, flux // 4), (one, -one)):
        turned = motor_shaft.Inputs(turn_d, turn_q, i_d, 0, 0, 0, 0)
        still = motor_shaft.Registers(0, 0, 0, 1, 0, 0)
        assert motor_shaft.step(motor_shaft.State(), turned, still)[1][0] == -turn_q * i_d >> PU.frac_bits
        turned = motor_shaft.Inputs(turn_d, turn_q, 0, i_d, 0, 0, 0)
        assert motor_shaft.step(motor_shaft.State(), turned, still)[1][0] == turn_d * i_d >> PU.frac_bits


@pytest.mark.parametrize("name", [*residual.NAMES, "drone_24v", "paper000", "brusa_hsm1"])
def test_which_motors_differ_follows_from_their_data(name):
    """Magnets 5 % weaker, R 30 % higher: not seen where the current makes most of the flux; docs/faults.md."""
    drive = residual.drive_of(name)
    least, m = residual.least_flagged(drive), drive.machine
    of_current = max(m.inductance_d_h, m.inductance_q_h) * drive.current_limit_a / m.magnet_flux_wb
    assert (least.magnets < 0.05, least.resistance < 0.3) == ((True, True) if of_current < 1.9 else (False, False))
