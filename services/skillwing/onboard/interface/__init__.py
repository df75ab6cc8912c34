"""The functional layer as an interface: what whoever stands in its place has to serve, as data and as a page.

`skillwing.onboard.topics` spells the keys and says what a message holds.
What the two have to do with each other, who offers and who
uses each, how often, and what happens without it, is said here, and only here.
"""
