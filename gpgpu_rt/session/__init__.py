"""Sessions: a scene built for a choice of method and options, its rays and pictures."""
