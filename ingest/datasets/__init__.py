"""Published data sets with a reference attitude. docs/datasets.md says what each holds and how its frames are read."""

__all__ = ["broad", "euroc", "repoimu"]
