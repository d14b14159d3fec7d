"""The documentation site: copies the pages and generates the reference (tools/make_site.py)."""
