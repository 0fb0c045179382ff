"""What meets all limits together: changes tried on moved trials."""
