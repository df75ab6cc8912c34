"""What goes over the wire, as data: the table of keys, and the page and the JSON Schema that are made from it.

`channels.py` says what each key means; whoever needs all keys (documentation, fuzzing) takes them from there.
"""
