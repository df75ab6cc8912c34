"""The functional layer's API: topics and messages, one module a subject, which any vehicle or node may serve.

A module has keys, messages and `TOPICS`, a row for each key. Skills, resources and missions do not appear here. The
modules need only msgspec.

Frames are ENU for the world (x east, y north, z up, origin at the home pad) and FLU for the body (REP 103). Headings
are radians, counter-clockwise from east. `token` is a fencing token: an integer that grows with every grant. A node
refuses a command whose token is smaller than the newest one seen for the same axis.

Array streams carry raw little-endian bytes in the payload, and a header message as attachment.
"""
