"""The small world of the diagrams, and how passes are drawn."""
