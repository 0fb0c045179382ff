"""The models of this package; none imports another."""
