# SPDX-License-Identifier: BSD-3-Clause
"""Which canonical columns a voltage balance requires.

Five kinds of recordings contain enough: currents with commanded voltages, dq values of which u_d may be absent, the
terminal voltages of a machine that is driven without current (EMF run), of which one is enough, voltage and power
of an analyser beside dq currents or their references, and torque, current and speed of a dyno sheet.
"""

from __future__ import annotations

CURRENTS = {"i_a", "i_b", "i_c", "i_d", "i_q"}
COMMANDED = {"d_a", "d_b", "d_c", "u_d_ref", "u_q_ref"}
PHASE_VOLTAGES, LINE_VOLTAGES = ("u_a", "u_b", "u_c"), ("u_ab", "u_bc", "u_ca")


def has_terminal_voltages(have) -> bool:
    """Whether three phase voltages or two line-to-line voltages are among the names ``have``."""
    return set(PHASE_VOLTAGES) <= set(have) or len(set(LINE_VOLTAGES) & set(have)) >= 2


def is_emf_run(have) -> bool:
    """Whether the names ``have`` are those of an EMF run: terminal voltages, and no commanded ones.

    One of them is enough where no current was recorded.
    """
    one = set(PHASE_VOLTAGES + LINE_VOLTAGES) & set(have) and not CURRENTS & set(have)
    return bool(has_terminal_voltages(have) or one) and not COMMANDED & set(have)


def is_analysed(have) -> bool:
    """Whether the names ``have`` are those of a power analyser's table, with currents or their references."""
    currents = {"i_d", "i_q"} <= set(have) or {"i_d_ref", "i_q_ref"} <= set(have)
    return currents and {"u_line", "p_el", "omega_e"} <= set(have) and not COMMANDED & set(have)


def is_dyno(have) -> bool:
    """Whether the names ``have`` are those of a dyno sheet: torque, current and speed, and no voltage."""
    voltages = COMMANDED | set(PHASE_VOLTAGES + LINE_VOLTAGES) | {"u_line"}
    return {"torque", "i_q", "omega_e"} <= set(have) and not voltages & set(have)


def missing_columns(have: set[str]) -> list[str]:
    """What a balance lacks, as texts for a message; empty if the names ``have`` suffice."""
    if is_emf_run(have) or is_analysed(have) or is_dyno(have):
        return []
    if "u_line" in have and not COMMANDED & have:
        needed = {"omega_e", "p_el", "i_d_ref", "i_q_ref"}
        return [f"for a power-analyser table: {', '.join(sorted(needed - have))}"]
    missing = []
    phases = len({"i_a", "i_b", "i_c"} & have) >= 2
    dq = {"i_d", "i_q"} <= have
    if not phases and not dq:
        half = [name for name in ("i_d", "i_q") if name in have]
        other = {"i_d": "i_q", "i_q": "i_d"}
        missing.append(other[half[0]] if half else "currents (i_a, i_b or i_d, i_q)")
    if not have & ({"theta_e"} if phases and not dq else {"theta_e", "omega_e"}):
        missing.append("the angle theta_e" if phases and not dq else "theta_e or omega_e")
    if not {"d_a", "d_b", "d_c"} <= have and "u_q_ref" not in have:
        missing.append("voltages (d_a, d_b, d_c or u_d_ref, u_q_ref, or of an EMF run u_a, u_b, u_c or u_ab, u_bc)")
    return missing
