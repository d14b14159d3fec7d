"""What surfaces and light look like: materials, textures, lights, scene files, and what of it a
scene needs."""
