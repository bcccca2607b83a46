# SPDX-License-Identifier: BSD-3-Clause
"""A drive in SI units, as drive.toml describes it once, and the bases of the per-unit numbers.

Peak values throughout, amplitude-invariant dq frames, angles and speeds electrical unless a name says
otherwise.  ``load(path)`` reads a file; ``registers.registers(drive)`` makes the core's integers of it.

Default bases, unless [bases] gives others (range of a per-unit number +-2, of a current in the stator frame +-1.375):

    I_base      current at the upper end of the ADC code
    U_base      half the voltage at full bus code, so that the code's scale ends at 2
    omega_base  pole_pairs * rated mechanical speed: twice the rated speed can be represented
    lambda_base U_base / omega_base
"""

import dataclasses
import math
from dataclasses import dataclass

from golden_model.drive_checks import check
from golden_model.drive_file import read_sections
from golden_model.drive_keys import DriveError, flag, needed, not_negative, positive, real, trim, whole
from golden_model.front_ends import Converters, Encoder
from golden_model.motion import Position
from golden_model.supply import Supply


@dataclass(frozen=True)
class Machine:
    """[machine]: the motor and its load, as the core and `fluxproof simulate` know it."""

    # Names as in plant.Machine, so that ``plant.Machine.from_mapping(asdict(...))`` works.

    pole_pairs: int = whole(1, 63, "pole pairs")
    resistance_ohm: float = positive("ohm", "per phase at temperature_ref_c")
    inductance_d_h: float = positive("H", "d axis")
    inductance_q_h: float = positive("H", "q axis")
    magnet_flux_wb: float = not_negative("Wb", "flux linkage of the magnets, peak")
    rated_current_a: float = positive("A", "phase current, peak")
    rated_speed_rad_s: float = positive("rad/s", "mechanical")
    inertia_kgm2: float = not_negative("kg m2", "rotor and load", 0.0)
    viscous_friction_nms: float = not_negative("Nm s", "per mechanical rad/s", 0.0)
    coulomb_friction_nm: float = not_negative("Nm", "of the shaft, against its motion", 0.0)
    temperature_ref_c: float = real("degC", "of resistance and magnet flux", 20.0)
    temperature_winding_c: float = real("degC", "at the start of a simulation", 20.0)
    temperature_magnet_c: float = real("degC", "at the start of a simulation", 20.0)
    resistance_temp_coeff_per_k: float = real("1/K", "copper: 0.0039", 0.0)
    magnet_temp_coeff_per_k: float = real("1/K", "NdFeB: about -0.001", 0.0)
    saturation_d_per_a2: float = not_negative("1/A2", "see fluxproof/plant/pmsm.py", 0.0)
    saturation_q_per_a2: float = not_negative("1/A2", "see fluxproof/plant/pmsm.py", 0.0)
    cross_saturation_wb_per_a2: float = real("Wb/A2", "see fluxproof/plant/pmsm.py", 0.0)
    iron_conductance_s: float = not_negative("S", "1 / R_fe", 0.0)


@dataclass(frozen=True)
class Inverter:
    """[inverter]; thresholds, slopes, zero_current_a and switch_rated_v serve simulation alone."""

    # Names as in plant.Inverter.

    dc_bus_v: float = positive("V", "nominal bus voltage")
    pwm_frequency_hz: float = positive("Hz", "one carrier up and down")
    dead_time_s: float = positive("s", "both gates of a leg off")
    min_pulse_s: float | None = positive("s", "of a leg, dead time included; this or min_on_time_s", None)
    v_switch_v: float = not_negative("V", "threshold of the switch", 0.0)
    v_diode_v: float = not_negative("V", "threshold of the diode", 0.0)
    r_switch_ohm: float = not_negative("ohm", "slope of the switch", 0.0)
    r_diode_ohm: float = not_negative("ohm", "slope of the diode", 0.0)
    zero_current_a: float = not_negative("A", "width of the zone around zero current", 0.0)
    min_on_time_s: float | None = positive("s", "shortest time that a switch is on; this or min_pulse_s", None)
    bootstrap_charge_s: float = not_negative("s", "all lower switches on before the drive switches; 0: none", 0.0)
    switch_rated_v: float | None = positive("V", "bus voltage that the switches stand; none: not judged", None)

    @property
    def leg_pulse_s(self):
        """Shortest pulse of a leg: what the switch sees and the dead time, which takes its part of every pulse."""
        return self.min_pulse_s if self.min_on_time_s is None else self.dead_time_s + self.min_on_time_s

    @property
    def on_time_s(self):
        """Shortest time that a switch is on."""
        return needed(self.min_pulse_s) - self.dead_time_s if self.min_on_time_s is None else self.min_on_time_s


@dataclass(frozen=True)
class Control:
    """[control]; a gain given here overrides the one calculated from the bandwidths."""

    current_bandwidth_hz: float = positive("Hz", "current loop")
    sample_time_s: float | None = positive("s", "1 / pwm_frequency_hz; half, if updated twice", None)
    duty_applied_after_samples: int = whole(0, 10, "whole samples between a duty and its period", 1)
    delay_samples: float = not_negative("samples", "from sampling to the mean of the voltage", 1.5, most=10.0)
    speed_bandwidth_hz: float | None = positive("Hz", "speed loop; none: no speed control", None)
    speed_filter_hz: float | None = positive("Hz", "filter of the measured speed; none: no filter", None)
    current_limit_a: float | None = positive("A", "limit of the current, rated current if none", None)
    voltage_target: float = positive("1", "part of the voltage circle used above base speed", 0.98, most=1.0)
    weakening_bandwidth_hz: float = positive("Hz", "voltage loop above base speed", 20.0)
    torque_rise_s: float = positive("s", "shortest time from zero to the largest torque, with the torque table", 2e-3)
    mode_change_s: float = positive("s", "shortest time from zero to a limit where a mode begins", 0.02)
    torque_bandwidth_hz: float = not_negative("Hz", "correction of the torque by the estimated flux", 2.0)
    voltage_reserve: float = not_negative("1", "part of the voltage circle left unused", 0.0, most=0.99)
    voltage_fundamental: float | None = positive(
        "1", "largest fundamental, of the circle; 1.1 with [core] overmodulation, else 1", None, most=1.1015
    )
    current_kp_d_v_per_a: float | None = not_negative("V/A", "override", None)
    current_kp_q_v_per_a: float | None = not_negative("V/A", "override", None)
    current_ki_d_v_per_as: float | None = not_negative("V/(A s)", "override", None)
    current_ki_q_v_per_as: float | None = not_negative("V/(A s)", "override", None)
    speed_kp_as_per_rad: float | None = not_negative("A s/rad", "override, per electrical rad/s", None)
    speed_ki_a_per_rad: float | None = not_negative("A/rad", "override, per electrical rad", None)
    flux_mode: int = whole(0, 3, "0: current model, 1: merged models, 2: paper 001 eq. (16), 3: eq. (17)", 3)
    flux_crossover_hz: float | None = positive("Hz", "voltage model above, current model below", None)
    flux_damping: float = positive("1", "damping of the merge of both models", math.sqrt(0.5))
    flux_bandwidth_hz: float | None = positive("Hz", "compensation by delta_lambda", None)
    flux_min_speed_rad_s: float = positive("rad/s", "mechanical; no compensation below", 2.0)
    flux_compensation_limit_wb: float | None = positive("Wb", "largest compensation", None)
    flux_kp: float | None = not_negative("1", "override", None)
    flux_ki_per_s: float | None = not_negative("1/s", "override", None)
    dead_time_compensation: bool = flag("true: compensate dead time and device drops", True)
    sign_current_a: float | None = positive("A", "current above which a direction is +-1", None)
    v_dead_filter_hz: float = positive("Hz", "low-pass of paper 000, Fig. 3", 5.0)
    v_dead_eta: float = positive("1", "step of the V_dead Adaline, paper 000 eq. (10)", 1e-5)
    v_dead_gamma: float = not_negative("1", "proportional part of the compensation", 0.1)
    v_dead_zeta: float = not_negative("1", "gain of the minimisation per sample", 1e-4)
    v_dead_threshold_v: float | None = not_negative("V", "leg voltage below which the minimisation stops", None)
    v_dead_start_v: float | None = not_negative("V", "leg voltage compensated from the start; see scaling.py", None)
    v_dead_limit_v: float | None = positive("V", "largest leg voltage that is compensated", None)
    psi_eta: float | None = positive("s2/rad2", "step of the psi_m Adaline, paper 000 eq. (13)", None)
    psi_min_speed_rad_s: float | None = positive("rad/s", "mechanical; psi_m is held below", None)
    winding_temp_min_c: float = real("degC", "lowest valid temperature", -40.0)
    winding_temp_max_c: float = real("degC", "highest valid temperature", 200.0)


@dataclass(frozen=True)
class Sensors:
    """[sensors]; offsets in codes of the converter, gains as trims around one."""

    adc_bits: int = whole(12, 16, "of the current and bus converters")
    current_range_a: float = positive("A", "current at the upper end of the code, mid code is zero")
    u_dc_range_v: float = positive("V", "bus voltage at full code")
    position_bits: int = whole(8, 18, "codes per mechanical turn; of a resolver with several pole pairs, per its own")
    position_pole_pairs: int = whole(
        1, 63, "pole pairs of a resolver: turns of its code in one of the shaft; divides [machine] pole_pairs", 1
    )
    current_offset_code: tuple | None = real("codes", "at zero current, mid code if none", None, count=3)
    current_gain: tuple = trim("negative for a reversed sensor", (1.0, 1.0, 1.0), 3, signed=True)
    current_sensors: int = whole(2, 3, "3, or 2: phase a has none, its current is minus the sum of the others", 3)
    low_side_settle_s: float | None = positive(
        "s", "shunts in the lower legs: until one shows the current after its switch is on; none: elsewhere", None
    )
    u_dc_offset_code: float = not_negative("codes", "at zero volts", 0.0)
    u_dc_gain: float = trim("of the bus voltage", 1.0)
    position_reverse: bool = flag("true: the code counts against the phase order", False)
    theta_offset_rad: float = real("rad", "electrical angle at code zero", 0.0)


@dataclass(frozen=True)
class Sampling:
    """[sampling], optional: when currents and position are taken; see docs/board.md."""

    delay_s: float = real("s", "real sampling instant after the valley or peak, negative before it", 0.0)


@dataclass(frozen=True)
class Protection:
    """[protection], all optional: what turns the gates off.

    A condition whose trip_ key is false is reported in the core's flags and does not trip.
    """

    current_trip_a: float | None = positive("A", "phase current, peak; twice the limit if none", None)
    current_sum_trip_a: float | None = positive("A", "sum of the phases, a fifth of rated current if none", None)
    rail_samples: int = whole(1, 15, "samples at the end of a code", 3)
    u_dc_min_v: float | None = not_negative("V", "a tenth of the nominal bus if none", None)
    u_dc_max_v: float | None = positive("V", "1.3 times the nominal bus if none", None)
    position_jump_rad: float | None = positive("rad", "mechanical, deviation from the extrapolated position", None)
    watchdog_periods: float = positive("1", "longest time without a sample, in sample times", 1.5)
    overspeed_rad_s: float | None = positive("rad/s", "mechanical; 1.2 times the rated speed if none", None)
    runaway_rad_s: float | None = positive("rad/s", "mechanical, against the reference; a tenth of rated if none", None)
    runaway_s: float | None = positive(
        "s", "longest time against the reference without braking; 20 ms if none, with Hall sensors a sector more", None
    )
    standstill_rad_s: float | None = positive("rad/s", "mechanical; the shaft stands below; 1 % of rated if none", None)
    stall_s: float = positive("s", "time at the current limit at standstill that is a stall", 0.1)
    encoder_lost_v: float | None = positive("V", "by which the EMF may be wrong at rest; from the data if none", None)
    encoder_lost_s: float | None = not_negative("s", "so long that the EMF is wrong; 0: no check", None)
    residual_v: float | None = positive("V", "mean of the motor's residual at rest; from the data if none", None)
    residual_s: float = not_negative("s", "so long that it is above its limits; 0: no check", 0.01)
    open_load_a: float | None = positive("A", "current that a connected phase reaches; 2 % of rated if none", None)
    current_offset_a: float | None = positive("A", "mean of a phase at rest; 1 % of the rated current if none", None)
    heartbeat_s: float = not_negative("s", "longest time without a write of the host; 0: no limit", 0.0)
    brake_on_v: float | None = positive("V", "brake resistor on from this bus voltage; none: no brake resistor", None)
    brake_off_v: float | None = positive("V", "off below this one, above dc_bus_v; 97 % of brake_on_v if none", None)
    regen_start_v: float | None = positive("V", "braking current limited from this bus voltage; none: no limit", None)
    regen_end_v: float | None = positive("V", "no braking current from here on; midway to u_dc_max_v if none", None)
    trip_overcurrent: bool = flag("false: reported, no trip", True)
    trip_current_sum: bool = flag("false: reported, no trip; for a third current calculated from two", True)
    trip_at_rail: bool = flag("false: reported, no trip", True)
    trip_u_dc_low: bool = flag("false: reported, no trip", True)
    trip_u_dc_high: bool = flag("false: reported, no trip", True)
    trip_position: bool = flag("false: reported, no trip", True)
    trip_watchdog: bool = flag("false: reported, no trip", True)
    trip_overspeed: bool = flag("false: reported, no trip", True)
    trip_runaway: bool = flag("false: reported, no trip", True)
    trip_stall: bool = flag("false: reported, no trip; for a drive that holds a torque at rest in speed mode", True)
    trip_open_load: bool = flag("true: an open load trips", False)
    trip_current_offset: bool = flag("false: reported, no trip", True)
    trip_encoder_lost: bool = flag("false: reported, no trip", True)
    trip_host_lost: bool = flag("false: reported, no trip", True)


@dataclass(frozen=True)
class Core:
    """[core]: the clock, what is built in, and the levels of its pins."""

    clock_hz: float = positive("Hz", "of the core; a whole multiple of twice the PWM frequency")
    updates_per_period: int = whole(1, 2, "1: sampled and updated at the valley; 2: at the valley and the peak", 1)
    estimators: bool = flag("false: field-oriented control alone; flux_mode and the compensation have no effect", True)
    references: bool = flag("true: current references by a table of torque and flux limit, docs/speed_range.md", False)
    position_loop: bool = flag("true: a position loop over the speed loop, docs/position.md", False)
    residual: bool = flag("true: the motor beside its description, docs/faults.md; needs the estimators", False)
    modes: bool = flag("true: voltage mode and changes of mode without a step, docs/modes.md", False)
    overmodulation: bool = flag("true: fundamentals of the voltage up to six-step, docs/overmodulation.md", False)
    gearing: bool = flag("true: the position loop can follow a second encoder, docs/gearing.md", False)
    ring_rows: int = whole(0, 2730, "telemetry rows of the ring in block RAM, 42 in a RAMB36; 0: none", 0)
    gate_active: int = whole(0, 1, "level of the gate pins at which a switch is on", 1)
    trip_active: int = whole(0, 1, "level of the pin trip that turns the gates off", 1)
    brake_active: int = whole(0, 1, "level of the pin brake at which the resistor is on", 1)
    trip_filter_s: float = not_negative("s", "shorter pulses of the pin trip have no effect; 0: all trip", 0.0, 1e-5)

    @property
    def trip_filter_clocks(self):
        """Generic TRIP_FILTER: a shorter pulse is seen by no more clocks than these."""
        return math.ceil(self.trip_filter_s * self.clock_hz * (1.0 - 1e-9))


@dataclass(frozen=True)
class BaseChoice:
    """[bases], all optional: the SI values of 1.0 per unit; docs/design.md has the ranges."""

    current_a: float | None = positive("A", "per-unit base; current_range_a if none", None)
    voltage_v: float | None = positive("V", "per-unit base; half of u_dc_range_v if none", None)
    omega_me_rad_s: float | None = positive("rad/s", "per-unit base, electrical; at rated speed if none", None)


@dataclass(frozen=True)
class Bases:
    """The SI values of 1.0 per unit; peak values, electrical speed."""

    current_a: float
    voltage_v: float
    omega_me_rad_s: float

    @property
    def flux_wb(self):
        return self.voltage_v / self.omega_me_rad_s


@dataclass(frozen=True)
class Drive:
    """One drive; refuses sections that contradict each other (``dataclasses.replace`` checks again)."""

    machine: Machine
    inverter: Inverter
    control: Control
    sensors: Sensors
    core: Core
    base_choice: BaseChoice = BaseChoice()
    protection: Protection = Protection()
    sampling: Sampling = Sampling()
    encoder: Encoder = Encoder()
    converters: Converters = Converters()
    supply: Supply = Supply()
    position: Position = Position()

    def __post_init__(self):
        check(self)

    @property
    def bases(self):
        choice, sensors, machine = self.base_choice, self.sensors, self.machine
        return Bases(
            choice.current_a or sensors.current_range_a,
            choice.voltage_v or sensors.u_dc_range_v / 2,
            choice.omega_me_rad_s or machine.pole_pairs * machine.rated_speed_rad_s,
        )

    @property
    def code_pairs(self):
        """Electrical turns in a turn of the position code: the pole pairs of the motor over those of a resolver."""
        return self.machine.pole_pairs // self.sensors.position_pole_pairs

    @property
    def torque_base_nm(self):
        """The torque of 1.0 per unit: flux linkage and current both at their bases."""
        return 1.5 * self.machine.pole_pairs * self.bases.flux_wb * self.bases.current_a

    @property
    def sample_time_s(self):
        """A PWM period, sampled at the valley of the carrier; half of one, if sampled at the peak too."""
        return 1.0 / (self.core.updates_per_period * self.inverter.pwm_frequency_hz)

    @property
    def sampling_to_voltage_s(self):
        """From the real sampling instant to the middle of the period (or half) in which the voltage acts."""
        return self.control.delay_samples * self.sample_time_s - self.sampling.delay_s

    @property
    def current_limit_a(self):
        limit = self.control.current_limit_a
        return self.machine.rated_current_a if limit is None else limit

    @property
    def working_current_a(self):
        """The current that checks of the sensors go by: rated, or the drive's own limit where the motor is larger."""
        return min(self.machine.rated_current_a, self.current_limit_a)

    @property
    def current_sensors(self):
        """2 where [sensors] or [converters] say so: the third current is computed then."""
        return min(self.sensors.current_sensors, self.converters.currents)

    @property
    def fundamental(self):
        """Largest fundamental of the voltage, of the circle u_dc/sqrt(3): above 1 with over-modulation."""
        given = self.control.voltage_fundamental
        return (1.1 if self.core.overmodulation else 1.0) if given is None else given

    @property
    def nominal_flux_wb(self):
        """Magnitude of the flux linkage at i_d = 0 and rated current."""
        m = self.machine
        return math.hypot(m.magnet_flux_wb, m.inductance_q_h * m.rated_current_a)

    @property
    def carrier_half(self):
        """Half a PWM period in clocks; ``check`` ensures that it is an integer."""
        return round(self.core.clock_hz / (2.0 * self.inverter.pwm_frequency_hz))


SECTIONS = {
    "machine": Machine,
    "inverter": Inverter,
    "control": Control,
    "sensors": Sensors,
    "core": Core,
    "bases": BaseChoice,
    "protection": Protection,
    "sampling": Sampling,
    "encoder": Encoder,
    "converters": Converters,
    "supply": Supply,
    "position": Position,
}


def load(path):
    """Read a drive from a TOML file; DriveError names the file, the key and what is wrong."""
    sections = read_sections(path, SECTIONS)
    try:
        return Drive(*sections.values())
    except DriveError as error:
        raise DriveError(f"{path}: {error}") from None


def with_carrier(drive, carrier_half):
    """The same drive with ``carrier_half`` clocks in half a PWM period, for clock-accurate simulations.

    Only the clock changes, to ``2*carrier_half*pwm_frequency``; sample time and gains stay.  Dead
    time and minimum pulse keep their values in seconds, so their number of clocks changes.
    """
    core = dataclasses.replace(drive.core, clock_hz=2.0 * carrier_half * drive.inverter.pwm_frequency_hz)
    # Front ends whose own clock comes from the core's are not part of such a simulation: it starts at the codes.
    encoder = drive.encoder if drive.encoder.clock_hz is None else Encoder()
    converters = Converters(currents=drive.converters.currents)
    return dataclasses.replace(drive, core=core, encoder=encoder, converters=converters)
