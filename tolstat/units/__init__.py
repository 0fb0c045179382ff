"""Quantities as engineers write them, turned into SI numbers."""
