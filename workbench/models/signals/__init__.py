"""Signals and draws by position: noise, tones, envelopes, rhythms, and the counter-based random numbers behind them."""
