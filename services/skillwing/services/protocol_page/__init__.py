"""The page and JSON Schema of the protocol, made from the table of keys in `wire`.

`protocol.md.template` has the prose.
"""
