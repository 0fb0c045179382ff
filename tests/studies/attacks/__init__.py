"""Attacks on files and disks, by hand: see the README."""
