"""What is asked of runs: a room for each question."""
