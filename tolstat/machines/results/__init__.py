"""Results from elsewhere: the rows of a file are the trials."""
