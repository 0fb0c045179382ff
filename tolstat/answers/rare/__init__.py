"""The answer about a rare run and its limit."""
