"""Pictures: integrators, and the table of features that a scene needs of them."""
