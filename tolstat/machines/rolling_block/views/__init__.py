"""What the rolling block can show."""
