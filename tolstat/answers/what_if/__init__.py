"""What a run would have found with other tolerances."""
