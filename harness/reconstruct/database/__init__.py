"""The database of poses that methods learn from, and windows of consecutive poses in it."""
