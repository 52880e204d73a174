"""Modal objects and what strikes them: `bank.ring` and `impact.blow` for scripts; the kernels of both behind them."""
