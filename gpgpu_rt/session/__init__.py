"""A session: a scene built for one choice of method and options, and what it can do."""
