"""Several trials side by side, one in each lane of a vector register."""
