"""What a model can show: histories, charts, tables; a trial again."""
