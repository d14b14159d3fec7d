"""The survey's figures and tables. Each module is named after what its figure shows."""
