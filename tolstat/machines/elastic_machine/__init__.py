"""The elastic machine: a chain of masses on springs, started from its other end."""
