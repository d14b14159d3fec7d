"""Pictures: integrators, and the table that says which of their features a scene needs."""
