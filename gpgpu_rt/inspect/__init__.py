"""Looking into a traversal: its passes, costs and programs."""
