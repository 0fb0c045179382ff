"""The contract of a model, and its checks."""
