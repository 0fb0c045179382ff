"""The doubt that few measured parts leave in every number of a run."""
