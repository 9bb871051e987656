"""Proof on worlds that the tool did not make: drawn at random, simulated by another engine, sealed."""
