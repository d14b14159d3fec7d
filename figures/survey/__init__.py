"""The survey's figures and tables, and the modules that they share.

The module of a figure or table is named after its number and after what it shows.
"""
