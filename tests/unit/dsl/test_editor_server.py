"""The language server as an editor meets it: a process, spoken to over its standard input and output."""

from __future__ import annotations

import asyncio
import re
import socket
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.client import LanguageClient

from skillwing.dsl.commands.language_server import language_server
from skillwing.dsl.commands.source import UsageError

URI = "file:///boat.skillset"
WHO = lsp.TextDocumentIdentifier(URI)
# The clef is two units of UTF-16 and one character; the sail behind it stands at unit 23.
BOAT = """\
skillset boat {
    /* 𝄞 */ resource sail { initial DOWN  DOWN -> UP  UP -> DOWN }
    skill tack {
        effect { hoist: sail -> UP  strike: sail -> DOWN }
        precondition { down: resource=(sail == DOWN)  success hoist }
        result { DONE: apply=strike }
    }
}
"""
SAIL = lsp.Range(lsp.Position(1, 22), lsp.Position(1, 26))
LIMIT = 60.0


class Editor(LanguageClient):
    """Notes the diagnostics that the server sends, and sends whole texts."""

    def __init__(self) -> None:
        super().__init__("test", "1")
        self._version = 1
        self.diagnostics: asyncio.Queue[list[lsp.Diagnostic]] = asyncio.Queue()

        @self.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def note(params: lsp.PublishDiagnosticsParams) -> None:  # pyright: ignore[reportUnusedFunction]
            self.diagnostics.put_nowait(list(params.diagnostics))

    def types(self, text: str) -> None:
        self._version += 1
        document = lsp.VersionedTextDocumentIdentifier(self._version, URI)
        changes = [lsp.TextDocumentContentChangeWholeDocument(text)]
        self.text_document_did_change(lsp.DidChangeTextDocumentParams(document, changes))


@asynccontextmanager
async def editing(text: str, encoding: lsp.PositionEncodingKind | None = None) -> AsyncIterator[Editor]:
    editor = Editor()
    command = "from skillwing.dsl.editor.server import server; server.start_io()"
    await editor.start_io(sys.executable, "-c", command)
    general = lsp.GeneralClientCapabilities(position_encodings=[encoding] if encoding else None)
    await editor.initialize_async(lsp.InitializeParams(lsp.ClientCapabilities(general=general)))
    editor.initialized(lsp.InitializedParams())
    editor.text_document_did_open(lsp.DidOpenTextDocumentParams(lsp.TextDocumentItem(URI, "skillset", 1, text)))
    try:
        yield editor
    finally:
        await editor.shutdown_async(None)
        editor.exit(None)
        await editor.stop()


def in_editor(
    conversation: Callable[[Editor], Awaitable[None]],
    text: str = BOAT,
    encoding: lsp.PositionEncodingKind | None = None,
) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), editing(text, encoding) as editor:
            await conversation(editor)

    asyncio.run(run())


def of_sail(kind: type[Any], **more: object) -> Any:
    """A question about the resource in line 2."""
    return kind(text_document=WHO, position=lsp.Position(1, 24), **more)


def test_a_conversation() -> None:
    async def conversation(editor: Editor) -> None:
        assert await editor.diagnostics.get() == []

        hover = await editor.text_document_hover_async(of_sail(lsp.HoverParams))
        assert hover is not None
        assert isinstance(hover.contents, lsp.MarkupContent)
        assert "resource sail { initial DOWN" in hover.contents.value
        assert hover.range == SAIL

        use = lsp.DefinitionParams(WHO, lsp.Position(4, 40))
        assert await editor.text_document_definition_async(use) == lsp.Location(URI, SAIL)

        references = await editor.text_document_references_async(
            of_sail(lsp.ReferenceParams, context=lsp.ReferenceContext(include_declaration=False))
        )
        assert [place.range.start.line for place in references or []] == [3, 3, 4]
        highlights = await editor.text_document_document_highlight_async(of_sail(lsp.DocumentHighlightParams))
        assert [place.range.start.line for place in highlights or []] == [1, 3, 3, 4]

        offered = await editor.text_document_completion_async(lsp.CompletionParams(WHO, lsp.Position(5, 30)))
        assert isinstance(offered, list)
        assert [item.label for item in offered] == ["hoist", "strike"]

        prepared = await editor.text_document_prepare_rename_async(of_sail(lsp.PrepareRenameParams))
        assert prepared == lsp.PrepareRenamePlaceholder(SAIL, "sail")
        renamed = await editor.text_document_rename_async(of_sail(lsp.RenameParams, new_name="jib"))
        assert renamed is not None and renamed.changes is not None
        assert [edit.new_text for edit in renamed.changes[URI]] == ["jib"] * 4
        assert renamed.changes[URI][0].range == SAIL
        with pytest.raises(JsonRpcException, match="`7` is not a name"):
            await editor.text_document_rename_async(of_sail(lsp.RenameParams, new_name="7"))

        outline = await editor.text_document_document_symbol_async(lsp.DocumentSymbolParams(WHO))
        assert outline is not None
        assert [
            entry.name for whole in outline if isinstance(whole, lsp.DocumentSymbol) for entry in whole.children or ()
        ] == ["sail", "tack"]
        folds = await editor.text_document_folding_range_async(lsp.FoldingRangeParams(WHO))
        assert [(fold.start_line, fold.end_line) for fold in folds or []] == [(0, 6), (2, 5)]
        colours = await editor.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(WHO))
        assert colours is not None and len(colours.data) % 5 == 0
        # Line, unit and length of the first two names: `boat`, and `sail` a line further down.
        assert [*colours.data[0:3], *colours.data[5:8]] == [0, 9, 4, 1, 22, 4]

        options = lsp.FormattingOptions(tab_size=4, insert_spaces=True)
        formatted = await editor.text_document_formatting_async(lsp.DocumentFormattingParams(WHO, options))
        assert formatted is not None

        editor.text_document_did_close(lsp.DidCloseTextDocumentParams(WHO))
        assert await editor.diagnostics.get() == []

    in_editor(conversation)


def test_problems_are_reported_while_somebody_types() -> None:
    async def conversation(editor: Editor) -> None:
        assert await editor.diagnostics.get() == []
        editor.types(BOAT.replace("apply=strike", "apply=strik"))
        editor.types(BOAT.replace("apply=strike", "apply=strikee"))
        while not (problems := await editor.diagnostics.get()) or "strikee" not in problems[0].message:
            pass
        problem = problems[0]
        assert problem.code == "SW012"
        assert problem.severity == lsp.DiagnosticSeverity.Error
        assert problem.message.endswith("\nDid you mean `strike`?")
        assert problem.range == lsp.Range(lsp.Position(5, 29), lsp.Position(5, 36))

        actions = await editor.text_document_code_action_async(
            lsp.CodeActionParams(WHO, problem.range, lsp.CodeActionContext([problem]))
        )
        assert actions is not None
        (action,) = actions
        assert isinstance(action, lsp.CodeAction)
        assert action.edit is not None and action.edit.changes is not None
        assert list(action.edit.changes[URI]) == [lsp.TextEdit(problem.range, "strike")]

        editor.types("skillset s {\n data { a: bool }\n data { a: bool }\n enum E { A ; } }")
        twice, stray = await editor.diagnostics.get()
        assert (twice.code, stray.code) == ("SW016", "SW004")
        (related,) = twice.related_information or []
        assert related.location.range.start.line == 1

        # A text with syntax errors is not formatted.
        options = lsp.FormattingOptions(tab_size=4, insert_spaces=True)
        assert await editor.text_document_formatting_async(lsp.DocumentFormattingParams(WHO, options)) is None

    in_editor(conversation)


def test_the_client_chooses_how_columns_are_counted() -> None:
    async def conversation(editor: Editor) -> None:
        hover = await editor.text_document_hover_async(lsp.HoverParams(WHO, lsp.Position(1, 21)))
        assert hover is not None and hover.range is not None
        assert hover.range.start == lsp.Position(1, 21)

    in_editor(conversation, encoding=lsp.PositionEncodingKind.Utf32)


def test_without_the_library_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "skillwing.dsl.editor.server", raising=False)
    monkeypatch.setitem(sys.modules, "pygls.lsp.server", None)
    with pytest.raises(UsageError, match=re.escape("pip install 'skillwing[editor]'")):
        language_server()


def test_a_port_in_use_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UsageError, match=f"Port {port} cannot be opened: Address already in use."):
            language_server(tcp=port)
