# SPDX-License-Identifier: BSD-3-Clause
"""The SI values of the registers of field weakening, see docs/speed_range.md.

Voltage loop: d(u**2)/d(share) is 2*u_max**2, so k_voltage = w*T_s/(2*u_max**2) makes it cross over at w.  Torque
correction: the torque follows torque_gain by torque_ref, so k_torque = w*T_s/torque**2 makes it cross over at w at the
largest torque; at less torque it is slower by the square.  It learns where the flux estimator compensates fully.
"""

import math

from golden_model import torque_table
from golden_model.formats import KI
from golden_model.scale_entry import Entry, base_keys
from golden_model.scaling import CROSSOVER_PART, FADED_IN
from golden_model.units import TURN_RAD

SHARE_MIN = 0.5  # a machine whose flux linkage is twice that of its table is another machine


def table_of(drive, flux=None) -> torque_table.TorqueTable:
    """The table of a drive; ``flux``: its flux linkage, see torque_table.measured; else the nameplate's."""
    flux = flux or torque_table.linear(drive.machine)
    return torque_table.build(flux, drive.machine.pole_pairs, drive.current_limit_a)


def references(drive, table):
    """The registers of the torque table and of what corrects it; ``table`` None: without a torque table, all zero."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    on, volts = table is not None, base_keys(drive, "voltage_v")
    inverse = 1.0 / table.flux_wb[-1] if on else 0.0
    keys = "[machine] inductance_d_h, inductance_q_h, magnet_flux_wb; [control] current_limit_a"
    yield Entry("use_table", int(on), "1", 1.0, "[core] references")
    yield Entry("k_flux", inverse, "1/Wb", 1.0 / b.flux_wb, f"{keys}; {volts}")
    yield Entry("u_share", c.voltage_target * on * (1.0 - 2.0**-16), "1", 1.0, "[control] voltage_target")
    u_max = drive.inverter.dc_bus_v / math.sqrt(3.0) / b.voltage_v
    gain = TURN_RAD * c.weakening_bandwidth_hz * t_s / (2.0 * u_max**2) if on else 0.0
    yield Entry("k_voltage", gain, "1", 1.0, "[control] weakening_bandwidth_hz; [inverter] dc_bus_v, pwm_frequency_hz")
    yield Entry("share_min", SHARE_MIN * on, "1", 1.0, "none")
    learns = on and drive.core.estimators
    most = table.top_nm[-1] / drive.torque_base_nm if on else 1.0
    gain = TURN_RAD * c.torque_bandwidth_hz * t_s / most**2 if learns else 0.0
    gain = min(gain, KI.hi * KI.lsb)  # a small torque per unit: the correction is slower then
    yield Entry("k_torque", gain, "1", 1.0, f"[control] torque_bandwidth_hz; {keys}")
    omega_0 = m.pole_pairs * m.rated_speed_rad_s / CROSSOVER_PART
    omega_0 = TURN_RAD * c.flux_crossover_hz if c.flux_crossover_hz is not None else omega_0
    omega_min = m.pole_pairs * c.flux_min_speed_rad_s
    learn = max(FADED_IN * omega_0, 2.0 * omega_min) if on else 0.0
    keys = "[control] flux_crossover_hz, flux_min_speed_rad_s; [machine] rated_speed_rad_s"
    yield Entry("omega_learn", learn, "rad/s", b.omega_me_rad_s, f"{keys}; {base_keys(drive, 'omega_me_rad_s')}")
    step = table.top_nm[-1] * min(t_s / c.torque_rise_s, 1.0) if on else 0.0
    yield Entry("torque_step", step, "Nm", drive.torque_base_nm, "[control] torque_rise_s, current_limit_a; [machine]")
    yield Entry("table_word", 0, "1", 1.0, "none: loads the torque table")
