"""Running studies: stimuli through a live session, answers from the floor, simulated studies, and levels of patches."""
