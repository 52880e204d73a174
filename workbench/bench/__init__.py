"""Benchmarks: run time against error, requirements on the models, latency, stability under stress, and large floors."""
