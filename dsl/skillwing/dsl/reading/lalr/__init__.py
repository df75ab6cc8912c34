"""The LALR machine of a dialect: scanner and tables made from its grammar by Lark, and the automaton that runs them."""
