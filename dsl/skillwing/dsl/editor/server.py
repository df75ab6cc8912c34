"""The language server: it holds the open documents and answers requests by the functions of this folder."""

from __future__ import annotations

import asyncio
from importlib.metadata import version

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

from skillwing.dsl.editor.completion import completions
from skillwing.dsl.editor.description import hover
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.fixes import fixes
from skillwing.dsl.editor.messages import LEGEND, Messages
from skillwing.dsl.editor.names import Occurrence
from skillwing.dsl.editor.outline import folds, outline
from skillwing.dsl.editor.rename import Edit, RenameRefusedError, rename, renameable
from skillwing.dsl.editor.tokens import tokens
from skillwing.dsl.printing.formatting import UnformattableError, format_source

# A text is checked after this time without a key stroke, in seconds.
_QUIET = 0.15
_TRIGGERS = [">", "=", ":", ".", "("]


class SkillsetServer(LanguageServer):
    """The server for skillset files. Documents are sent whole, so that positions are counted in one place only."""

    def __init__(self) -> None:
        super().__init__(  # pyright: ignore[reportUnknownMemberType] - it takes any further arguments
            "skillwing", version("skillwing"), text_document_sync_kind=lsp.TextDocumentSyncKind.Full
        )
        self._documents: dict[str, Document] = {}
        self._pending: dict[str, asyncio.TimerHandle] = {}

    def messages(self, uri: str) -> Messages:
        """The messages about the current text of a document. A changed text is read again."""
        text = self.workspace.get_text_document(uri)
        known = self._documents.get(uri)
        if known is None or known.text != text.source:
            known = self._documents[uri] = Document(text.source, text.path or uri)
        encoding = self.workspace.position_encoding or lsp.PositionEncodingKind.Utf16
        return Messages(known, uri, lsp.PositionEncodingKind(encoding).value)

    def check(self, uri: str) -> None:
        """Send all problems of a document to the client."""
        self._cancel(uri)
        messages = self.messages(uri)
        diagnostics = [messages.diagnostic(problem) for problem in messages.document.checked.diagnostics]
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, diagnostics))

    def check_soon(self, uri: str) -> None:
        self._cancel(uri)
        self._pending[uri] = asyncio.get_running_loop().call_later(_QUIET, self.check, uri)

    def forget(self, uri: str) -> None:
        self._cancel(uri)
        self._documents.pop(uri, None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def _cancel(self, uri: str) -> None:
        if (timer := self._pending.pop(uri, None)) is not None:
            timer.cancel()


server = SkillsetServer()


# --- the documents


@server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
def did_open(ls: SkillsetServer, params: lsp.DidOpenTextDocumentParams) -> None:
    ls.check(params.text_document.uri)


@server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
def did_change(ls: SkillsetServer, params: lsp.DidChangeTextDocumentParams) -> None:
    ls.check_soon(params.text_document.uri)


@server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
def did_close(ls: SkillsetServer, params: lsp.DidCloseTextDocumentParams) -> None:
    ls.forget(params.text_document.uri)


# --- about what stands at a position


@server.feature(lsp.TEXT_DOCUMENT_HOVER)
def on_hover(ls: SkillsetServer, params: lsp.HoverParams) -> lsp.Hover | None:
    messages = ls.messages(params.text_document.uri)
    found = hover(messages.document, messages.offset(params.position))
    return None if found is None else messages.hover(found)


@server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=_TRIGGERS))
def on_completion(ls: SkillsetServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    messages = ls.messages(params.text_document.uri)
    return messages.completions(completions(messages.document, messages.offset(params.position)))


@server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
def on_definition(ls: SkillsetServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    messages = ls.messages(params.text_document.uri)
    declared = [place for place in _occurrences(messages, params.position) if place.declares]
    return messages.location(declared[0].start, declared[0].end) if declared else None


@server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
def on_references(ls: SkillsetServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    messages = ls.messages(params.text_document.uri)
    places = _occurrences(messages, params.position)
    wanted = [place for place in places if params.context.include_declaration or not place.declares]
    return [messages.location(place.start, place.end) for place in wanted]


@server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
def on_highlight(ls: SkillsetServer, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
    messages = ls.messages(params.text_document.uri)
    places = _occurrences(messages, params.position)
    return [lsp.DocumentHighlight(messages.range(place.start, place.end)) for place in places]


def _occurrences(messages: Messages, position: lsp.Position) -> tuple[Occurrence, ...]:
    """All occurrences of the symbol at a position."""
    names = messages.document.names
    found = names.at(messages.offset(position))
    return () if found is None or found.symbol is None else names.of(found.symbol)


# --- changing names


@server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
def on_prepare_rename(ls: SkillsetServer, params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder:
    messages = ls.messages(params.text_document.uri)
    try:
        place = renameable(messages.document, messages.offset(params.position))
    except RenameRefusedError as refusal:
        raise _refused(refusal) from None
    return lsp.PrepareRenamePlaceholder(messages.range(place.start, place.end), place.name)


@server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
def on_rename(ls: SkillsetServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    messages = ls.messages(params.text_document.uri)
    try:
        edits = rename(messages.document, messages.offset(params.position), params.new_name)
    except RenameRefusedError as refusal:
        raise _refused(refusal) from None
    return messages.workspace_edit(edits)


def _refused(refusal: RenameRefusedError) -> JsonRpcException:
    return JsonRpcException(str(refusal), lsp.LSPErrorCodes.RequestFailed.value)


# --- about the whole document


@server.feature(lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix]))
def on_code_action(ls: SkillsetServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    messages = ls.messages(params.text_document.uri)
    start, end = messages.offset(params.range.start), messages.offset(params.range.end)
    return [messages.action(fix) for fix in fixes(messages.document, start, end)]


@server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
def on_formatting(ls: SkillsetServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit] | None:
    """The formatted text; nothing while it has syntax errors, which the client shows anyway."""
    messages = ls.messages(params.text_document.uri)
    text = messages.document.text
    try:
        formatted = format_source(text, messages.document.file)
    except UnformattableError:
        return None
    return [] if formatted == text else [messages.edit(Edit(0, len(text), formatted))]


@server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
def on_document_symbol(ls: SkillsetServer, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
    messages = ls.messages(params.text_document.uri)
    return [messages.symbol(entry) for entry in outline(messages.document)]


@server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
def on_folding_range(ls: SkillsetServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
    messages = ls.messages(params.text_document.uri)
    return [messages.fold(fold) for fold in folds(messages.document)]


@server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, LEGEND)
def on_semantic_tokens(ls: SkillsetServer, params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
    messages = ls.messages(params.text_document.uri)
    return messages.tokens(tokens(messages.document))
