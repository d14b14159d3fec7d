"""The bounding interval hierarchy (Waechter and Keller 2006)."""
