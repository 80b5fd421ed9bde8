"""Benchmarks: what the parts cost against a peer, both measured in turn in one run."""
