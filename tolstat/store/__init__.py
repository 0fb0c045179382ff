"""Runs in HDF5 files."""
