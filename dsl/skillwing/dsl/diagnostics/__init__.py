"""What is wrong in a source file, and how it is shown."""
