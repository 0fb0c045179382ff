"""What a rare run says of its limit."""
