"""The two missions of the library with other answers to a failure, for comparisons; not for real flights."""
