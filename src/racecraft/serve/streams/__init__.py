"""What tabs are sent while a model learns."""
