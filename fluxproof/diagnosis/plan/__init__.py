# SPDX-License-Identifier: BSD-3-Clause
"""From a Decision to the next recording: the operating points that separate what is open."""
