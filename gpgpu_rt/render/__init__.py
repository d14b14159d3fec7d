"""Pictures: integrators, and what a scene needs of them."""
