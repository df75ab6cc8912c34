"""Editor support for skillset files, and the language server.

Everything but `server.py` is a function of a text and an offset. It works on files with errors, as far as the parser
reads them.
"""
