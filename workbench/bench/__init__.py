"""Benchmarks: run time against error, reach of the models, latency, stability under stress, and large floors."""
