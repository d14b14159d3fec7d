"""What lies on disk: files read and written whole, their budget, and folders of one's own."""
