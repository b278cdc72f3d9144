"""What the benchmarks have in common: the work, the clock, the tables."""
