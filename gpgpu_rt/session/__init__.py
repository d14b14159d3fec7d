"""Sessions. A session builds a method's accelerator over a scene and traces rays through it.
`Pictures` draws the scene with the rays of a session."""
