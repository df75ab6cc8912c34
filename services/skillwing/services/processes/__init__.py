"""Processes: what starts, hosts, watches, finds and ends them."""
