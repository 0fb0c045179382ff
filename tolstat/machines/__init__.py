"""The machines; none knows another."""
