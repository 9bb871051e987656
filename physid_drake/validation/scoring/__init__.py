"""Compares what a diagnosis said with the truth of its world, and sums it up over worlds."""
