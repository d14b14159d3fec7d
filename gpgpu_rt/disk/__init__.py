"""Disk: safe reading and writing of files, limits on their memory, and private folders."""
