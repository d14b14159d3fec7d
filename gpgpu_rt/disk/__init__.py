"""Disk: reads and writes files safely, limits the memory that a file may require, and makes
private folders."""
