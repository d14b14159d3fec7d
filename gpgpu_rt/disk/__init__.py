"""Disk: safe reading and writing of files, the memory budget of files, and private folders."""
