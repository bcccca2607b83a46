# SPDX-License-Identifier: BSD-3-Clause
"""Answers of the diagnosis judged against declared truths, for the studies ``real`` and ``mishaps``."""
