"""Sampled signals: intervals, gaps, interpolation."""
