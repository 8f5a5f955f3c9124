"""The same body and device in another engine: `python -m benchmarks.peers`."""
