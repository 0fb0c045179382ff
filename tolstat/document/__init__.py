"""Documents as data: sentences, tables and figures, for any medium."""
