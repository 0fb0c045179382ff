"""Studies of tolstat itself: how often intervals hold, how fast and exact it is.

They take minutes to hours and are run by hand; tests hold their tables to the code.
"""
