"""The small world that diagrams are drawn from, and how passes are drawn."""
