# SPDX-License-Identifier: BSD-3-Clause
"""Resources and timing of the core as open tools see them: ``make synth``; see docs/synth.md."""
