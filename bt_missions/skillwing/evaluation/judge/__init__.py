"""Ground-truth judge of a flight, and the files that it reads and writes."""
