"""Which contributors matter."""
