"""Ray classification and visibility fields: structures over rays."""
