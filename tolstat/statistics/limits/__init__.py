"""Responses against their limits."""
