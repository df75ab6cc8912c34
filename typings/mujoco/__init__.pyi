# MuJoCo's bindings ship no type information; without this file every name in them would be an error.
from typing import Any

def __getattr__(name: str) -> Any: ...
