"""The table of keys: `channels.py` has the rows, `channel.py` the form of a row.

`protocol_page` makes the page and JSON Schema from it.
"""
