"""Usual causes of what Python says about a launch file, and what to write instead. Pure.

What upstream and Python say stays as it is; a sentence follows that a person can act upon. An error inside ``$(eval)``
or ``PythonExpression`` names the whole expression, which no traceback shows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from enclave_launch.description.absent_modules import modules_with_all_names_imported
from enclave_launch.description.substitutions.computed import expression_of

_OBJECT = re.compile(r"<(?:[\w.]+\.)?(?:<locals>\.)?(\w+) object at 0x[0-9a-fA-F]+>")
_LONGEST = 300  # characters of an expression in a message
_WORDS_OF_PYTHON = {"true": "True", "false": "False", "null": "None", "none": "None", "nan": "math.nan"}
_NOT_DEFINED = re.compile(r"name '(\w+)' is not defined")
_NO_TEXT = re.compile(
    r"\bnot (?:'|\"|instance of )?(?:launch\w*\.[\w.]*)?"
    r"(LaunchConfiguration|PathJoinSubstitution|FindPackageShare|Command|PythonExpression|TextSubstitution"
    r"|EnvironmentVariable|ThisLaunchFileDir)\b|\bnot '?(\w*Substitution)\b"
)
_NO_ENTITY = re.compile(r"'(\w+)' object has no attribute '(?:describe_sub_entities|visit|scan_role)'")
_NO_DESCRIPTION = "get_launch_arguments_with_include"
_NO_CONDITION = re.compile(r"'(\w+)' object has no attribute 'evaluate'")


def without_addresses(text: str) -> str:
    """Replace ``<launch_ros.actions.node.Node object at 0x7f...>`` by ``<Node>``: an address says nothing."""
    return _OBJECT.sub(r"<\1>", text)


def usual_cause(error: BaseException, text: str) -> str:
    """Return the lines about an error that a Python launch file, or an expression in any, raised."""
    return "".join(f"\n{line}" for line in (*_of_expression(error), *_of_python(error, text)))


def _of_expression(error: BaseException) -> Iterator[str]:
    expression = expression_of(error)
    if expression is None:
        return
    shown = expression if len(expression) <= _LONGEST else f"{expression[:_LONGEST]} ..."
    yield f"in the expression: {shown}"
    if isinstance(error, NameError) and (unknown := _NOT_DEFINED.search(str(error))):
        word = unknown[1]
        if word in _WORDS_OF_PYTHON:
            yield (
                f"Python writes {_WORDS_OF_PYTHON[word]}; compare the text of an argument instead, "
                f"in quotes: '$(var x)' == '{word}'"
            )
        else:
            yield f"if {word} is the value of an argument, put it in quotes: '$(var x)' == '{word}'"
    elif isinstance(error, SyntaxError):
        yield "substitutions are performed before Python reads it: a text needs quotes around it, '$(var x)'"


def _of_python(error: BaseException, text: str) -> Iterator[str]:
    if isinstance(error, TypeError) and (found := _NO_TEXT.search(text)):
        kind = found[1] or found[2]
        yield (
            f"a {kind} has no value before the launch file is visited: hand it on in a list "
            f"(['a', {kind}(...)]), join paths by PathJoinSubstitution, or read it in an OpaqueFunction by "
            ".perform(context)"
        )
    elif isinstance(error, NameError) and (modules := modules_with_all_names_imported()):
        yield f"it may be a name of {', '.join(modules)}, which is not installed: the file imports * from it"
    elif isinstance(error, AttributeError) and _NO_DESCRIPTION in text:
        yield "generate_launch_description() must return a LaunchDescription"
    elif isinstance(error, AttributeError) and (found := _NO_ENTITY.search(text)):
        yield f"a {found[1]} stands where an action is expected: in a LaunchDescription, a group or a result"
    elif isinstance(error, AttributeError) and (found := _NO_CONDITION.search(text)):
        yield f"condition= takes a condition, such as IfCondition(...), not a {found[1]}"
    elif "executed more than once: <" in text:
        yield "one object stands in two places of the launch description: make an object for each"
