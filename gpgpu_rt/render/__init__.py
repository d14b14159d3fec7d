"""Pictures: integrators, and the table that says which features of them a scene needs."""
