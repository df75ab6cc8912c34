"""What an editor asks about a skillset file, and the language server that answers.

Everything but `server.py` is a function of a text and an offset in it, and works on files with errors as far as the
parser could read them.
"""
