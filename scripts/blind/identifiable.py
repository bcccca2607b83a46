"""Which effects a recording can tell by design, whatever the estimator."""
from __future__ import annotations


def judge(case) -> dict:
    """{"all": bool, "effects": {name: bool}} by rule."""
    plan, names = case.build.plan, case.names
    with_d = any(abs(s[1]) > 0.05 * case.build.nominal.machine["rated_current_a"] for s in plan.segments)
    verdict = {}
    for name in names:
        good = True
        if name in ("inductance_d",):
            good = with_d
        if name in ("cogging", "friction"):
            good = case.build.with_torque or (plan.free and name == "cogging")
        if name in ("current_scale", "udc_gain"):
            good = case.build.with_torque
        if case.stratum == "one_point":
            good = name in ("emf_harmonics", "encoder_eccentricity", "current_gain") and good
        verdict[name] = bool(good)
    return {"all": all(verdict.values()), "effects": verdict}
