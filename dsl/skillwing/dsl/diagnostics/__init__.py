"""Problems in a source file and their presentation."""
