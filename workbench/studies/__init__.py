"""Studies at work: stimuli through a running session, floors that answer, simulated studies, and their levels."""
