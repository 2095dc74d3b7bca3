"""Truth tables and speed of the verbs for a device: characterize, validate and trust."""
