"""The functional layer as an interface: the topics that a process in place of another one has to serve.

`table.py` has the topics by section, `functional-layer.md.template` the prose.
"""
