"""The analysed grammars that are stored beside them: `make generate` writes them after a change of a grammar."""

from __future__ import annotations

from skillwing.dsl.reading.rl.dialect import RL
from skillwing.dsl.reading.rlc.dialect import RLC
from skillwing.dsl.reading.skillset.dialect import SKILLSET

DIALECTS = (SKILLSET, RL, RLC)

if __name__ == "__main__":
    for dialect in DIALECTS:
        dialect.stored.write_text(dialect.analysed_again(), encoding="utf-8")
