"""A program run in the abstract: values, variables, statements, expressions, calls, objects."""
