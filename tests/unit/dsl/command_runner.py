"""Runner of single commands, which ends them after a user's error as `skillwing` does."""

from __future__ import annotations

from typing import Any

from typer.testing import CliRunner, Result

from skillwing.services.terminal.exit_codes import exit_code_of, user_message


class CommandRunner(CliRunner):
    """A runner whose results have the message and the exit code of a user's error."""

    def invoke(self, *args: Any, **settings: Any) -> Result:
        result = super().invoke(*args, **settings)
        error = result.exception
        if isinstance(error, Exception) and (message := user_message(error)) is not None:
            said = f"{message}\n".encode()
            result.exit_code = exit_code_of(error)
            result.stderr_bytes = (result.stderr_bytes or b"") + said
            result.output_bytes += said
        return result
