"""The statistical tolerance report of a run."""
