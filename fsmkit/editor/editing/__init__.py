"""Operations on charts as edits of their YAML and SCXML files."""
