"""What is asked: studies read, checked and run."""
