"""Solutions: fields, estimated error, warnings, tables, pictures and files."""
