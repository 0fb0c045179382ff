"""Asking: one machine evaluated, moved, shown; a stored trial again."""
