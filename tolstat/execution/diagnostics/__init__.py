"""What is computed once the trials of a run are done."""
