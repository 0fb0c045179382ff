"""The cheapest tolerances that meet all limits."""
