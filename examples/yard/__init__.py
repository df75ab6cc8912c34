"""A yard: the places that several robots share, as a skillset with a resource manager of its own."""
