"""Measured parts of a file, judged by the tolerance of their drawing."""
