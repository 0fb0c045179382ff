"""Several trials in parallel, one in each lane of a vector register."""
