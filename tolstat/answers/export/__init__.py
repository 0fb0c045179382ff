"""Trials of a run as a table or a workbook, for other programs."""
