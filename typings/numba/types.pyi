# Only what the simulator uses.
from typing import Any

class Type:
    def __call__(self, *arguments: Type) -> Any: ...

void: Type
uintp: Type

class ExternalFunction:
    def __init__(self, symbol: str, sig: Any) -> None: ...
    def __call__(self, *arguments: int) -> None: ...
