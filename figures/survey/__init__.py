"""The survey's figures and tables, in modules named after number and content, and shared modules.
"""
