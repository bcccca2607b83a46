"""A drive in SI units to the integers of the core's registers; docs/drives/*.toml -> Registers, Config.

Every register is ``integer = SI value / scale``, rounded half up in its port's format, where ``scale`` is
what 1.0 of that format means.  Symbols: I, U, w, L are the bases of current, voltage, electrical speed
and flux linkage, T_s the sample time, p the pole pairs.

Regulators.  The current loops cancel the pole of R and L with the zero of the PI and cross over at
w_c:  kp = w_c*L_x,  ki = w_c*R.  The speed loop crosses over at w_s on the integrator
d(omega_me)/dt = 1.5*p**2*lambda_mg/J * i_q:  Kp = w_s*J/(1.5*p**2*lambda_mg), and Ki = Kp*w_s/5 puts the
integral's corner a factor of five below the crossover, where it costs 11 degrees of phase (atan(1/5))
and still removes a load step within a few times 5/w_s.
"""

import math
from typing import NamedTuple

from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.fluxproof import REGISTERS, Config, Registers
from golden_model.units import TURN_RAD

INTEGRAL_CORNER = 5.0  # speed crossover over the corner of the speed regulator's integral
ROUND_UP = ("dead_time", "min_pulse")  # times that must not come out shorter than asked


class Entry(NamedTuple):
    """What one register shall hold: SI value, its unit, SI per 1.0 of the format, keys that made it."""

    name: str
    si: float
    unit: str
    scale: float
    keys: str


class Row(NamedTuple):
    """One register as printed; ``error`` = represented - SI, ``relative`` = error / SI or None at zero."""

    name: str
    si: float
    unit: str
    integer: int
    represented: float
    error: float
    relative: float | None
    low: int
    high: int


class RegisterSet(NamedTuple):
    """Integers for the core, generics for its top entity, and how they came about."""

    values: Registers
    config: Config
    rows: tuple[Row, ...]


def registers(drive: Drive) -> RegisterSet:
    """All registers of a drive; DriveError names the keys of one that does not fit its range."""
    entries = {e.name: e for part in PARTS for e in part(drive)}
    rows = {name: _row(entries[name], port) for name, port in REGISTERS.items()}
    _keep_pulse_above_dead_time(rows, drive)
    config = Config(drive.sensors.adc_bits, drive.sensors.position_bits, drive.carrier_half)
    values = Registers(*(rows[name].integer for name in REGISTERS))
    return RegisterSet(values, config, tuple(rows.values()))


def sensing(drive):
    """Codes to per-unit currents, bus voltage and position; codes count in the converter's own LSB."""
    s, b = drive.sensors, drive.bases
    mid = 2.0 ** (s.adc_bits - 1)
    for phase, code, trim in zip("abc", s.current_offset_code or (mid,) * 3, s.current_gain, strict=True):
        yield Entry(f"offset_{phase}", code, "code", mid, "[sensors] adc_bits, current_offset_code")
        keys = "[sensors] current_range_a, current_gain; [bases] current_a"
        yield Entry(f"gain_{phase}", trim * s.current_range_a, "A", b.current_a, keys)
    yield Entry("u_dc_offset", s.u_dc_offset_code, "code", mid, "[sensors] adc_bits, u_dc_offset_code")
    keys = "[sensors] u_dc_range_v, u_dc_gain; [bases] voltage_v"
    yield Entry("u_dc_gain", s.u_dc_gain * s.u_dc_range_v / 2.0, "V", b.voltage_v, keys)
    k_u_max = (1.0 - drive.control.voltage_reserve) / math.sqrt(3.0)
    yield Entry("k_u_max", k_u_max, "1", 1.0, "[control] voltage_reserve")
    yield Entry("pole_pairs", drive.machine.pole_pairs, "1", 1.0, "[machine] pole_pairs")
    yield Entry("reverse", int(s.position_reverse), "1", 1.0, "[sensors] position_reverse")
    yield Entry("theta_offset", s.theta_offset_rad % TURN_RAD, "rad", TURN_RAD, "[sensors] theta_offset_rad")


def speed_loop(drive):
    """Speed from position codes, its filter and the speed regulator (gains zero without a bandwidth)."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    base = "[machine] pole_pairs, rated_speed_rad_s; [bases] omega_me_rad_s"
    k_speed = TURN_RAD * m.pole_pairs / t_s  # electrical rad/s per mechanical turn and sample
    yield Entry("k_speed", k_speed, "rad/s", b.omega_me_rad_s, f"[inverter] pwm_frequency_hz; {base}")
    k_filter = 1.0 if c.speed_filter_hz is None else -math.expm1(-TURN_RAD * c.speed_filter_hz * t_s)
    yield Entry("k_filter", k_filter, "1", 1.0, "[control] speed_filter_hz")
    kp, ki = speed_gains(drive)
    keys = "[machine] inertia_kgm2, magnet_flux_wb, pole_pairs; [control] speed_bandwidth_hz"
    kp_keys = keys if c.speed_kp_as_per_rad is None else "[control] speed_kp_as_per_rad"
    ki_keys = keys if c.speed_ki_a_per_rad is None else "[control] speed_ki_a_per_rad"
    per_speed = b.current_a / b.omega_me_rad_s
    yield Entry("speed_kp", kp, "A s/rad", per_speed, f"{kp_keys}; {base}")
    yield Entry("speed_ki", ki, "A/rad", per_speed / t_s, f"{ki_keys}; {base}")
    limit = "[machine] rated_current_a" if c.current_limit_a is None else "[control] current_limit_a"
    yield Entry("i_max", drive.current_limit_a, "A", b.current_a, f"{limit}; [bases] current_a")


def speed_gains(drive):
    """(Kp [A s/rad], Ki [A/rad]) of the speed regulator, per electrical speed and angle."""
    c, m = drive.control, drive.machine
    kp = ki = 0.0
    if c.speed_bandwidth_hz is not None:
        w_s = TURN_RAD * c.speed_bandwidth_hz
        kp = w_s * m.inertia_kgm2 / (1.5 * m.pole_pairs**2 * m.magnet_flux_wb)
        ki = kp * w_s / INTEGRAL_CORNER
    kp = kp if c.speed_kp_as_per_rad is None else c.speed_kp_as_per_rad
    ki = ki if c.speed_ki_a_per_rad is None else c.speed_ki_a_per_rad
    return kp, ki


def current_loop(drive):
    """Current regulators, flux model of the decoupling, advance of the output angle."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    w_c, ohm = TURN_RAD * c.current_bandwidth_hz, b.voltage_v / b.current_a
    base = "[bases] current_a, voltage_v"
    for axis in "dq":
        henry = getattr(m, f"inductance_{axis}_h")
        kp, kp_key = getattr(c, f"current_kp_{axis}_v_per_a"), f"[control] current_kp_{axis}_v_per_a"
        ki, ki_key = getattr(c, f"current_ki_{axis}_v_per_as"), f"[control] current_ki_{axis}_v_per_as"
        if kp is None:
            kp, kp_key = w_c * henry, f"[control] current_bandwidth_hz; [machine] inductance_{axis}_h"
        if ki is None:
            ki, ki_key = w_c * m.resistance_ohm, "[control] current_bandwidth_hz; [machine] resistance_ohm"
        yield Entry(f"kp_{axis}", kp, "V/A", ohm, f"{kp_key}; {base}")
        yield Entry(f"ki_{axis}", ki, "V/(A s)", ohm / t_s, f"{ki_key}; {base}")
        keys = f"[machine] inductance_{axis}_h; {base}, omega_me_rad_s"
        yield Entry(f"l_{axis}", henry, "H", b.flux_wb / b.current_a, keys)
    keys = "[machine] magnet_flux_wb; [bases] voltage_v, omega_me_rad_s"
    yield Entry("lambda_mg", m.magnet_flux_wb, "Wb", b.flux_wb, keys)
    keys = "[control] delay_samples; [inverter] pwm_frequency_hz; [bases] omega_me_rad_s"
    yield Entry("k_delay", c.delay_samples * t_s, "s", TURN_RAD / b.omega_me_rad_s, keys)


def gates(drive):
    """Times of the gate signals in clocks."""
    for name in ROUND_UP:
        keys = f"[inverter] {name}_s; [core] clock_hz"
        yield Entry(name, getattr(drive.inverter, f"{name}_s"), "s", 1.0 / drive.core.clock_hz, keys)


PARTS = (sensing, speed_loop, current_loop, gates)


def _row(entry, port):
    """The entry as an integer of the port's format, refused where the port cannot hold it."""
    value, lsb = entry.si / entry.scale, port.fmt.lsb
    up = entry.name in ROUND_UP
    # A relative 1e-9 above a whole number of clocks is the division's rounding, not a clock more.
    integer = math.ceil(value / lsb * (1.0 - 1e-9)) if up else math.floor(value / lsb + 0.5)
    if entry.unit == "rad":
        integer %= port.fmt.hi + 1  # an angle wraps: just below a turn rounds to zero
    if not port.low <= integer <= port.high:
        lo, hi = (f"{end * lsb * entry.scale:.6g}" for end in (port.low, port.high))
        unit = "" if entry.unit == "1" else f" {entry.unit}"
        raise DriveError(
            f"register {entry.name} from {entry.keys}: {entry.si:.6g}{unit} is {integer}, out of range: "
            f"allowed is {port.low} to {port.high}, that is {lo} to {hi}{unit}"
        )
    if integer == 0 and entry.si != 0.0 and entry.unit not in ("rad", "code"):
        least = lsb * entry.scale / 2.0
        raise DriveError(
            f"register {entry.name} from {entry.keys}: {entry.si:.6g} {entry.unit} rounds to zero: "
            f"allowed is 0 or at least {least:.6g} {entry.unit}"
        )
    return _printed(entry, port, integer)


def _printed(entry, port, integer):
    represented = integer * port.fmt.lsb * entry.scale
    error = represented - entry.si
    if entry.unit == "rad":
        error = (error + math.pi) % TURN_RAD - math.pi
    relative = error / entry.si if entry.si else None
    return Row(entry.name, entry.si, entry.unit, integer, represented, error, relative, port.low, port.high)


def _keep_pulse_above_dead_time(rows, drive):
    """On a coarse clock both times may round up to the same clock; the pulse then takes the next one."""
    dead, pulse = rows["dead_time"].integer, rows["min_pulse"].integer
    if pulse <= dead:
        entry = next(e for e in gates(drive) if e.name == "min_pulse")
        pulse = dead + 1
        rows["min_pulse"] = _printed(entry, REGISTERS["min_pulse"], pulse)
    if not pulse <= drive.carrier_half:
        raise DriveError(
            f"register min_pulse from [inverter] dead_time_s, min_pulse_s; [core] clock_hz: {pulse} clocks is "
            f"out of range: allowed is {dead + 1} to {drive.carrier_half}, half a PWM period"
        )
