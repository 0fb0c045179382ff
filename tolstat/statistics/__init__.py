"""Statistics on arrays: no files, no units, no pictures."""
