# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of the file: headers, separators, decimal commas, footers, names."""

from __future__ import annotations

import dataclasses

from studies.mishaps.log import Log, Mishap

NAMES = {"t": "Zeit [ms]", "i_d": "Id_ist (A)", "i_q": "Iq_ist (A)", "u_d_ref": "Ud_soll (V)", "u_q_ref": "Uq_soll (V)"}
UNITS = {"t": "s", "theta_e": "rad", "omega_e": "rad/s", "u_dc": "V", "i_d": "A", "i_q": "A", "u_d_ref": "V",
         "u_q_ref": "V"}  # fmt: skip


def _with(**values):
    return lambda log: dataclasses.replace(log, **values)


def _two_lines(log: Log):
    units = ",".join(UNITS[n] for n in log.columns)
    return dataclasses.replace(log, header=f"{','.join(log.columns)}\n{units}")


def _german(log: Log):
    log = log.having(t=log.columns["t"] * 1e3).renamed(**NAMES)
    return dataclasses.replace(log, separator=";", decimal=",")


def _torn(log: Log):
    return dataclasses.replace(log, after="0.9123,0.12,")


def _strange(log: Log):
    return log.renamed(i_d="ch1", i_q="ch2", u_d_ref="ch3", u_q_ref="ch4")


MISHAPS = (
    Mishap("header of two lines", "dq", _two_lines),
    Mishap("title lines before the header", "dq", _with(before="Test 12, bench 3\nDate;2026-11-20\n\n")),
    Mishap("decimal comma", "dq", _with(separator=";", decimal=",")),
    Mishap("decimal comma slow", "slow", _with(separator="\t", decimal=",")),
    Mishap("German names", "dq", _german),
    Mishap("byte order mark", "slow", _with(encoding="utf-8-sig")),
    Mishap("UTF-16", "slow", _with(encoding="utf-16"), limit="UTF|encoding|text"),
    Mishap("last line torn", "dq", _torn, readings="row|line"),
    Mishap("footer", "slow", _with(after="# end of log\nstopped by user\n"), limit="line|row|number"),
    Mishap("names that say nothing", "dq", _strange, limit=r"\[columns\]"),
    Mishap("no header", "slow", lambda log: dataclasses.replace(log, header=",".join(
        f"{v[0]:.6g}" for v in log.columns.values())), limit=r"header|\[columns\]"),
    Mishap("columns with blanks", "dq", lambda log: dataclasses.replace(log, header=" , ".join(log.columns))),
)  # fmt: skip
