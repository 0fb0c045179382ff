"""Workers that evaluate blocks of trials: threads, processes, a cluster."""
