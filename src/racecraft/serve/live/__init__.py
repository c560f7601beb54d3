"""What tabs see while a model learns."""
