"""What is asked: a study, read and checked."""
