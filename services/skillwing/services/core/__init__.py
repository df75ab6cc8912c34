"""The semantics of skills, resources and data, written once: plain classes without I/O, threads or clock.

A core takes an event and the time of it, and returns what to send. Real processes, mocks, the in-process simulation
and the verifier all run these same classes.
"""
