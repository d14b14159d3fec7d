"""The survey's figures and tables, measured and drawn beside the published numbers."""
