"""Studies run on workers, and stored."""
