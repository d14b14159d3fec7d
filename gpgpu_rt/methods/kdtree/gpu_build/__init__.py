"""Construction of kd-trees by fragment passes."""
