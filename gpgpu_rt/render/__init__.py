"""Pictures: integrators draw pictures, and a table says which programs and data a scene needs."""
