"""A command as a model: a solver with an input file and an output file."""
