"""The engine: contexts, programs, records, textures and passes."""
