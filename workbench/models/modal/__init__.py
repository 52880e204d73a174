"""Modal objects and hammers: `bank.ring` and `impact.strike` for scripts, and their real-time kernels."""
