"""Results of a run with other tolerances, without a new run."""
