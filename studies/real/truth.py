# SPDX-License-Identifier: BSD-3-Clause
"""Every real or bench recording with its truth, as far as somebody knows it (README.md beside the recordings).

Sizes are intervals of the parameters of diagnosis.json.  Where several effects cannot be told apart by what was
recorded, all of them are names of one cause.  ``files`` of a case finds the recording, or makes a variant of it.
"""

from __future__ import annotations

import studies.real.files as f
from studies.scored.truth import Case, Cause, Truth

WIDE = {"resistance_ohm": (0.27, 0.41)}
WARM_R = Cause(("resistance",), {"resistance_ohm": (0.36, 0.385)}, may=("current_scale", "udc_gain", "dead_time"))
LOCKED = Truth((WARM_R,), text="resistance 0.37 of 0.28 ohm")
DEPHY = Truth(
    (Cause(("resistance", "dead_time", "resistance_temperature"), WIDE, may=("current_scale", "udc_gain")),),
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.0042, 0.0050)}),),
    limit=r"time does not advance",
    text="time of too few digits; resistance 0.28 to 0.37 ohm, rising with current: devices, dead time, warm winding",
)
TRIP = Truth(limit=r"gates? (were |was |are )?off|trip|switched off|fault", text="agrees until the gates are off")
RPM_LIMIT = r"rpm|revolutions|1/min"
METU = Truth(
    (
        Cause(
            ("encoder_offset",), {"offset_rad": (0.42, 0.54)}, may=("delay", "inductance_q"), may_read=r"angle_30\b",
            words=r"angle (of the voltage )?(is )?(off|ahead|behind)",
        ),
    ),
    (Cause(("dead_time",)), Cause(("magnet_flux",), {"magnet_flux_wb": (0.16, 0.2)})),
    text="angle of the voltage off by 25 to 30 degrees",
)  # fmt: skip
SATURATED = Truth(
    (Cause(("saturation",), may=("inductance_q",)), Cause(("cross_saturation",))),
    (Cause(("inductance_d",)), Cause(("inductance_q",)), Cause(("magnet_flux",), {"magnet_flux_wb": (0.4, 0.55)})),
    text="saturation and cross-saturation, resistance right",
)  # fmt: skip
SATURATED_FAST = Truth(
    SATURATED.causes, SATURATED.beside, limit=r"steady|short|longer|sample time", text=SATURATED.text
)
DRIFT = {"magnet_flux_drift_wb": (-0.0070, -0.0003)}
LINEAR = (
    Cause(("resistance",)), Cause(("inductance_d",)), Cause(("inductance_q",)), Cause(("magnet_flux",)),
    Cause(("resistance_temperature",)), Cause(("dead_time",)), Cause(("encoder_offset",)),
)  # fmt: skip
WARM_UP = Truth(
    (Cause(("magnet_temperature",), DRIFT, may=("resistance_temperature",), words=r"magnets? .*(warm|temperature)"),),
    LINEAR,
    text="magnets warm by 92 K, about -0.10 %/K; constants of the drive file ill-conditioned",
)
WARM = Truth(
    (Cause(("magnet_temperature",), DRIFT, may=("resistance_temperature",), words=r"magnets? .*(warm|temperature)"),),
    (Cause(("resistance_temperature",)),),
    text="magnets warm, -0.1 %/K",
)
LATE = Truth(
    (Cause(("delay", "sampling_skew", "iron_loss"), words=r"\blate\b|delay|instant|iron loss"),),
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.0080, 0.0088)}), Cause(("dead_time",)), Cause(("resistance",))),
    limit=r"(little|no|hardly any|without) (load|current)\b",
    never=r"from [-−]\d\d+ ?(degC|°C)",
    text="u_d = omega^2 psi 46 us: late voltage or angle, skew, or iron loss",
)
EMF = Truth(limit=r"(only )?one line(-to-line)? voltage|two of|second line", text="EMF, psi 5.805 of 5.8 mWb")
TIMETABLE = Truth(
    limit=r"'Dev1_ai0' may be terminal voltages", text=f"{EMF.text}; a MATLAB timetable whose column names no signal"
)
DYNO = r"u_q_ref.*not recorded|no (dq )?voltage|(first|lines?) .*(title|preamble|header)|units? .*(row|line) \d"
FRAMELESS = Truth(
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.0059, 0.0066)}),), (Cause(("delay",)), Cause(("friction",))),
    limit=DYNO, text="0.094 N m/A; no voltage of the control",
)  # fmt: skip
ODRIVE = Truth(
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.0026, 0.0029)}, words=r"angle .*(lost|slip)|spin"),),
    (Cause(("friction", "iron_loss")),),  # of a motor behind a transducer; the drive file has none
    limit=DYNO, text="0.0285 N m/A of 0.0306; the angle is lost at the end; no voltage recorded; drag",
)  # fmt: skip
MJ5208 = Truth(
    (
        Cause(("inductance_d", "saturation"), {"inductance_d_h": (58e-6, 76e-6)}),
        Cause(("magnet_flux",), {"magnet_flux_wb": (0.00276, 0.00287)}),
    ),
    text="L_d 67 of 26 uH, flux +13.5 %",
)
SPINDLE = Truth(
    (
        Cause(("inductance_d", "saturation"), {"inductance_d_h": (230e-6, 270e-6)}),
        Cause(("magnet_flux",), {"magnet_flux_wb": (0.0094, 0.0102)}),
    ),
    text="flux +86 %, L_d +30 %",
)
FLIPSKY = Truth(
    (Cause(("inductance_d", "saturation"), {"inductance_d_h": (20e-6, 31e-6)}),),
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.0044, 0.0050)}), Cause(("saturation",))),
    text="L_d +118 %, falling with current",
)
ONE_ANGLE = Truth(
    (Cause(("encoder_offset",), {"offset_rad": (0.41, 0.46)}, may=("delay",), may_read=r"angle_30\b"),),
    text="angle 25 degrees ahead, one dwell",
)
EMRAX_PSI = {"magnet_flux_wb": (0.035, 0.060)}
EMRAX = Truth(
    (
        Cause(("encoder_offset", "delay")),
        Cause(("magnet_flux",), EMRAX_PSI, may=("udc_gain", "current_scale")),
        Cause(("saturation", "cross_saturation", "inductance_q")),
    ),
    (Cause(("dead_time",)), Cause(("inductance_d",)), Cause(("magnet_temperature",)), Cause(("iron_loss",))),
    text="no reference; from three splits of the log: angle, magnet flux, saturation, loss of the inverter",
)
LAAS = Truth(
    (Cause(("magnet_flux",), {"magnet_flux_wb": (0.00138, 0.00175)}, may=("udc_gain",)),),
    (Cause(("resistance",), {"resistance_ohm": (0.25, 0.9)}), Cause(("friction",)), Cause(("cogging",)),
     Cause(("dead_time",)), Cause(("delay",))),
    limit=r"no stretch .* steady|i_d|one axis|q axis",
    text="q axis only, a torque sine of 2 Hz without a steady stretch; resistance assumed",
)  # fmt: skip
LAAS_STILL = Truth(
    (Cause(("resistance", "dead_time"), {"resistance_ohm": (0.25, 0.9)}, may=("current_scale", "udc_gain")),),
    (Cause(("cogging",)),),
    text="q axis at standstill; the resistance of the drive file is assumed, the loss of the driver is not known",
)
BRUSA = Truth(
    (Cause(("saturation",)), Cause(("cross_saturation",))),
    (Cause(("inductance_d",)), Cause(("inductance_q",)), Cause(("magnet_flux",))),
    text="a measured flux map in closed loop: saturation and cross-saturation",
)
CLOSED_LOOP = {
    "healthy_563v": (), "healthy_36v": (), "healthy_ipm": (), "dead_time_36v": ("dead_time",),
    "dead_time_ipm": ("dead_time",), "saturation_563v": ("saturation",), "saturation_ipm": ("saturation",),
    "encoder_offset_36v": ("encoder_offset",), "magnet_flux_563v": ("magnet_flux",),
    "magnet_flux_ipm": ("magnet_flux",), "current_offset_563v": ("current_offset",), "friction_36v": ("friction",),
}  # fmt: skip

CASES = (
    Case("locked_table", LOCKED, f.at("bench/locked_rotor", "locked_table.csv")),
    Case("locked_log", LOCKED, f.at("bench/locked_rotor", "locked_log.csv")),
    Case("locked_log_full", LOCKED, f.at("bench/locked_rotor", "locked_log_full.csv", "drive_plain.toml")),
    Case("dephy", DEPHY, f.at("bench/dephy", "motor_1.csv")),
    Case("moteus_mj5208", MJ5208, f.at("bench/moteus", "mj5208.csv", "mj5208.toml")),
    Case("moteus_spindle", SPINDLE, f.at("bench/moteus", "spindle.csv", "spindle.toml")),
    Case("moteus_flipsky6374", FLIPSKY, f.at("bench/moteus", "flipsky6374.csv", "flipsky6374.toml")),
    Case("pmsyr_slow", SATURATED, f.at("bench/pmsyr_slow", "slow.csv")),
    Case("pmsyr_rows_of_100_us", SATURATED_FAST, f.rows_apart("bench/pmsyr_slow", "slow.csv", 1e-4)),
    Case("metu_plain", Truth(METU.causes, METU.beside, limit=r"'vd1' for u_d_ref", text=METU.text),
         f.at("bench/metu", "module_1.csv")),
    Case("metu_columns", Truth(METU.causes, METU.beside, limit=r"lasts .*\[control\] sample_time_s", text=METU.text),
         f.metu(with_step=False)),
    Case("metu_columns_and_step", METU, f.metu(with_step=True)),
    Case("warm_up", WARM_UP, f.at("bench/warm_up", "log.csv")),
    Case("vesc_light", LATE, f.at("bench/vesc_light", "log.csv")),
    Case("trip", TRIP, f.at("bench/trip", "trip.parquet")),
    Case("trip_frozen", TRIP, f.at("bench/trip", "trip_frozen.parquet")),
    Case("rpm_no_unit", Truth(readings=RPM_LIMIT, limit=RPM_LIMIT, text="agrees; omega is rpm of the shaft"),
         f.at("bench/rpm", "rpm_only_nounit.csv")),
    Case("rpm_unnamed", Truth(readings=RPM_LIMIT, limit=RPM_LIMIT, never=r"'omega' for omega_e(?!.*\bunit)",
                              text="agrees; omega is rpm of the shaft"),
         f.at("bench/rpm", "rpm_only_nounit.csv", "../trip/drive.toml")),
    Case("rpm_no_angle", Truth(text="agrees"), f.at("bench/rpm", "no_angle.csv", "../trip/drive.toml")),
    Case("slow_index", LOCKED, f.at("bench/slow_index", "slow_dtindex.parquet")),
    Case("slow_t", LOCKED, f.at("bench/slow_index", "slow_t.csv")),
    Case("one_point_angle", ONE_ANGLE, f.at("bench/false_correction", "one_point.csv", "one_point.toml")),
    Case("warm_two_points", WARM, f.at("bench/false_correction", "warm.csv", "warm.toml")),
    Case("emf_line_100rpm", EMF, f.at("bench/emf_probe", "line_100rpm.csv")),
    Case("emf_line_300rpm", EMF, f.at("bench/emf_probe", "line_300rpm.csv")),
    Case("emf_timetable", TIMETABLE, f.at("bench/emf_probe", "line_200rpm_timetable.mat")),
    Case("dyno_frameless", FRAMELESS, f.at("bench/dyno", "frameless.csv", "frameless.toml")),
    Case("dyno_odrive", ODRIVE, f.at("bench/dyno", "odrive.csv", "odrive.toml")),
    Case("emrax228_log", EMRAX, f.with_drive("emrax228/coastdown_run.csv", f.DRIVES / "emrax228.toml")),
    Case("laas_torque_sine", LAAS, f.with_drive("laas_mn4004/acc_current.txt", f.MN4004)),
    Case("laas_standstill", LAAS_STILL, f.with_drive("laas_mn4004/stopped_data.txt", f.MN4004)),
    Case("brusa_map", BRUSA, f.brusa_loop),
    *(
        Case(f"closed_loop_{name}", Truth(tuple(Cause((n,)) for n in names)),
             f.at("closed_loop", f"{name}.parquet", f"{name}.toml"))
        for name, names in CLOSED_LOOP.items()
    ),
)  # fmt: skip
