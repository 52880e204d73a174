"""Modal objects and what strikes them: `bank.ring` and `impact.strike` for scripts; the kernels of both behind them."""
