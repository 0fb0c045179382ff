"""A page that answers: scenarios of a run, moved by hand."""
