"""Language Server Protocol messages from the answers about a document."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from lsprotocol import types as lsp

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.editor.completion import Completion
from skillwing.dsl.editor.description import Hover
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.fixes import QuickFix
from skillwing.dsl.editor.outline import Fold, OutlineEntry
from skillwing.dsl.editor.positions import Encoding
from skillwing.dsl.editor.rename import Edit
from skillwing.dsl.editor.tokens import TOKEN_TYPES, Token

_SOURCE = "skillwing"
_SEVERITIES = {"error": lsp.DiagnosticSeverity.Error, "warning": lsp.DiagnosticSeverity.Warning}
_UNUSED = frozenset({"SW081", "SW082", "SW083"})

LEGEND = lsp.SemanticTokensLegend(token_types=sorted(set(TOKEN_TYPES.values())), token_modifiers=["declaration"])

_SYMBOL_KINDS: Mapping[str, lsp.SymbolKind] = {
    "skillset": lsp.SymbolKind.Module,
    "type": lsp.SymbolKind.Struct,
    "datum": lsp.SymbolKind.Variable,
    "resource": lsp.SymbolKind.Class,
    "event": lsp.SymbolKind.Event,
    "skill": lsp.SymbolKind.Function,
    "field": lsp.SymbolKind.Field,
    "value": lsp.SymbolKind.EnumMember,
    "state": lsp.SymbolKind.EnumMember,
    "input": lsp.SymbolKind.Property,
    "output": lsp.SymbolKind.Property,
    "feedback": lsp.SymbolKind.Property,
    "effect": lsp.SymbolKind.Method,
    "precondition": lsp.SymbolKind.Boolean,
    "invariant": lsp.SymbolKind.Boolean,
    "result": lsp.SymbolKind.EnumMember,
}
_COMPLETION_KINDS: Mapping[str, lsp.CompletionItemKind] = {
    "type": lsp.CompletionItemKind.Struct,
    "scalar": lsp.CompletionItemKind.TypeParameter,
    "datum": lsp.CompletionItemKind.Variable,
    "resource": lsp.CompletionItemKind.Class,
    "field": lsp.CompletionItemKind.Field,
    "value": lsp.CompletionItemKind.EnumMember,
    "state": lsp.CompletionItemKind.EnumMember,
    "input": lsp.CompletionItemKind.Variable,
    "effect": lsp.CompletionItemKind.Method,
    "keyword": lsp.CompletionItemKind.Keyword,
}


class Messages:
    """The messages about one document. uri: the client's name for it; encoding: the unit of its columns."""

    def __init__(self, document: Document, uri: str, encoding: Encoding) -> None:
        self.document = document
        self._uri = uri
        self._encoding: Encoding = encoding

    def offset(self, position: lsp.Position) -> int:
        return self.document.lines.from_protocol(position.line, position.character, self._encoding)

    def range(self, start: int, end: int) -> lsp.Range:
        lines = self.document.lines
        return lsp.Range(
            lsp.Position(*lines.to_protocol(start, self._encoding)),
            lsp.Position(*lines.to_protocol(end, self._encoding)),
        )

    def location(self, start: int, end: int) -> lsp.Location:
        return lsp.Location(self._uri, self.range(start, end))

    def diagnostic(self, diagnostic: Diagnostic) -> lsp.Diagnostic:
        related = None
        if diagnostic.related is not None:
            place, words = diagnostic.related
            related = [lsp.DiagnosticRelatedInformation(self.location(*self.document.range(place)), words)]
        return lsp.Diagnostic(
            range=self.range(*self.document.range(diagnostic.span)),
            message="\n".join(filter(None, (diagnostic.message, diagnostic.help))),
            severity=_SEVERITIES[diagnostic.severity],
            code=diagnostic.code,
            source=_SOURCE,
            tags=[lsp.DiagnosticTag.Unnecessary] if diagnostic.code in _UNUSED else None,
            related_information=related,
        )

    def hover(self, hover: Hover) -> lsp.Hover:
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, hover.markdown), self.range(hover.start, hover.end))

    def completions(self, completions: Iterable[Completion]) -> list[lsp.CompletionItem]:
        return [
            lsp.CompletionItem(
                label=completion.text,
                kind=_COMPLETION_KINDS.get(completion.kind),
                detail=completion.kind,
                documentation=lsp.MarkupContent(lsp.MarkupKind.Markdown, completion.markdown),
                sort_text=f"{place:04}",
                text_edit=self.edit(Edit(completion.start, completion.end, completion.text)),
            )
            for place, completion in enumerate(completions)
        ]

    def edit(self, edit: Edit) -> lsp.TextEdit:
        return lsp.TextEdit(self.range(edit.start, edit.end), edit.text)

    def workspace_edit(self, edits: Iterable[Edit]) -> lsp.WorkspaceEdit:
        return lsp.WorkspaceEdit(changes={self._uri: [self.edit(edit) for edit in edits]})

    def action(self, fix: QuickFix) -> lsp.CodeAction:
        return lsp.CodeAction(
            title=fix.title,
            kind=lsp.CodeActionKind.QuickFix,
            diagnostics=[self.diagnostic(fix.diagnostic)],
            is_preferred=True,
            edit=self.workspace_edit([fix.edit]),
        )

    def symbol(self, entry: OutlineEntry) -> lsp.DocumentSymbol:
        return lsp.DocumentSymbol(
            name=entry.name,
            detail=entry.kind,
            kind=_SYMBOL_KINDS[entry.kind],
            range=self.range(entry.start, entry.end),
            selection_range=self.range(entry.name_start, entry.name_end),
            children=[self.symbol(child) for child in entry.children],
        )

    def fold(self, fold: Fold) -> lsp.FoldingRange:
        kind = lsp.FoldingRangeKind.Comment if fold.kind == "comment" else None
        return lsp.FoldingRange(fold.first_line, fold.last_line, kind=kind)

    def tokens(self, tokens: Iterable[Token]) -> lsp.SemanticTokens:
        """Each token relative to the one before it, as five numbers."""
        numbers: list[int] = []
        line, character = 0, 0
        for token in tokens:
            place = self.range(token.start, token.end)
            down = place.start.line - line
            along = place.start.character - (0 if down else character)
            length = place.end.character - place.start.character
            numbers += [down, along, length, LEGEND.token_types.index(TOKEN_TYPES[token.kind]), int(token.declares)]
            line, character = place.start.line, place.start.character
        return lsp.SemanticTokens(numbers)
