"""The survey's figures and tables, and the modules that they share."""
