"""Studies, read and checked."""
