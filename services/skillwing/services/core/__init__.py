"""Semantics of skills, resources and data, written once: plain classes without I/O, threads or clock.

A core takes an event and the time of it, and returns what to send. Real processes, mocks and the simulations run these
same classes; tests compare what the skillset checker reasons with what the resource core does.
"""
