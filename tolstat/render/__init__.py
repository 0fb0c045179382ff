"""Documents and figures as screen, page, CSV, JSON and pictures."""
