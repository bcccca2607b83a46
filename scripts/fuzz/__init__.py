# SPDX-License-Identifier: BSD-3-Clause
"""`make fuzz`: hostile and damaged inputs, drawn and made smaller by Hypothesis."""
