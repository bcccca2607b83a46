"""Resources and timing of the core as open tools see them: ``make synth``; see docs/synth.md."""
