"""Speed as ratios against peers, by CPU time, measured in the same run: python -m benchmarks [NAME...]."""
