"""The survey's figures and tables, named after what they show."""
