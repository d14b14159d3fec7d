"""Built-in scenes, made by generators."""
