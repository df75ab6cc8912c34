"""The table of keys, and the page and JSON Schema that are made from it.

`channels.py` has the rows, `protocol.md.template` the prose.
"""
