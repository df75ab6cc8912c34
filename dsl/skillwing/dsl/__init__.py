"""The skillset language: grammar, model, checker, generator.

`load` and `parse` turn source into a `Skillset`; every problem of a file is reported in one `SkillsetError`.
"""
