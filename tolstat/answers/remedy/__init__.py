"""The remedy of a run: what meets all its limits together."""
