"""Views of a model: histories, charts, tables; a trial simulated again."""
