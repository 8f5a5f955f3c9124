"""Benchmarks of the engine, beside peers, and by size: `make bench`."""
