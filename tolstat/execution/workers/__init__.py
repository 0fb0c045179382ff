"""Who evaluates blocks of trials: threads, other processes, a cluster."""
