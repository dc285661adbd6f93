"""The ``$(...)`` language. Each case was checked against upstream's own grammar (launch 3.7.1, lark)."""

from __future__ import annotations

import time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from enclave_launch.frontend.substitution_grammar import (
    MAX_NESTING,
    SubstitutionCall,
    TemplateSyntaxError,
    UnexpectedCharacters,
    UnexpectedEOF,
    called_names,
    parse_template,
    unescape,
)


def call(name: str, *args: str | SubstitutionCall | tuple[str | SubstitutionCall, ...]) -> SubstitutionCall:
    return SubstitutionCall(name, tuple(arg if isinstance(arg, tuple) else (arg,) for arg in args))


PARSED = {
    "empty text is one empty text": ("", ("",)),
    "plain text": ("a b", ("a b",)),
    "quotes outside of a call are literal": ("'q' it's \"x\"", ("'q' it's \"x\"",)),
    "parentheses outside of a call are literal": ("f(x)", ("f(x)",)),
    "dollar without parenthesis": ("$x $", ("$x $",)),
    "two dollars": ("$$(var x)", ("$", call("var", "x"))),
    "no argument": ("$(dirname)", (call("dirname"),)),
    "text around a call": ("a$(var x)b", ("a", call("var", "x"), "b")),
    "two calls": ("$(a)$(b)", (call("a"), call("b"))),
    "several arguments": ("$(f a b c)", (call("f", "a", "b", "c"),)),
    "name with digits, underscore, hyphen": ("$(find-pkg_2 p)", (call("find-pkg_2", "p"),)),
    "nested default": ("$(var a $(var b c))", (call("var", "a", call("var", "b", "c")),)),
    "mixed argument": ("$(env a/$(dirname).x)", (call("env", ("a/", call("dirname"), ".x")),)),
    "single quotes keep spaces and parentheses": ("$(var x 'a (b) c')", (call("var", "x", "a (b) c"),)),
    "double quotes": ('$(var x "it\'s")', (call("var", "x", "it's"),)),
    "empty quoted argument has no part": ("$(var x '')", (call("var", "x", ()),)),
    "call in quotes": ("$(eval '$(var x) == 1')", (call("eval", (call("var", "x"), " == 1")),)),
    "own quote escaped": (r"$(eval '\'$(var x)\'')", (call("eval", ("'", call("var", "x"), "'")),)),
    "quotes inside a quoted argument's call are literal": (
        """$(var a '$(var b "q")')""",
        (call("var", "a", call("var", "b", '"q"')),),
    ),
    "escaped parentheses": (r"$(var x \(y\))", (call("var", "x", "(y)"),)),
    "escaped quotes in an unquoted argument": (r"$(var x \'y\")", (call("var", "x", "'y\""),)),
    "escaped space does not protect": (r"$(var a\ b)", (call("var", "a\\", "b"),)),
    "commas and equal signs": ("$(var x a,b=c)", (call("var", "x", "a,b=c"),)),
    "tab is no separator": ("$(var x\ty)", (call("var", "x\ty"),)),
    "newline is no separator": ("$(var x\ny)", (call("var", "x\ny"),)),
    "escaped dollar": (r"\$(var x)", ("$(var x)",)),
    "two backslashes: still literal": (r"\\$(var x)", (r"\$(var x)",)),
    "backslash goes": (r"a\b", ("ab",)),
    "escaped backslash stays": (r"a\\b", (r"a\b",)),
    "backslash before a newline stays": ("a\\\nb", ("a\\\nb",)),
    "lone backslash at the end stays": ("a\\", ("a\\",)),
    "escaped call in an argument needs its parenthesis escaped, too": (
        r"$(env what/\$\(test asd\\\)) 10)",
        (call("env", "what/$(test", r"asd\)"), " 10)"),
    ),
}


@pytest.mark.parametrize(("text", "template"), PARSED.values(), ids=PARSED.keys())
def test_text_parses_to(text: str, template: tuple[str | SubstitutionCall, ...]) -> None:
    assert parse_template(text) == template


UNEXPECTED = {
    "space before the closing parenthesis (E71)": ("echo $(var x )", 13),
    "two spaces": ("$(var  x)", 6),
    "space after the opening parenthesis": ("$( var x)", 2),
    "no name": ("$()", 2),
    "name begins with a digit": ("$(1 x)", 2),
    "text after a quoted argument": ("$(var 'a'b)", 9),
    "quote inside an unquoted argument": ("$(var a'b')", 7),
    "open parenthesis in an argument": ("$(var (x))", 6),
    "escaped dollar, bare parenthesis": (r"$(var \$(x))", 8),
    "quoted argument inside a quoted argument": ("$(var a '$(var b 'c')')", 17),
    "tab after the name": ("$(var\tx)", 5),
}


@pytest.mark.parametrize(("text", "position"), UNEXPECTED.values(), ids=UNEXPECTED.keys())
def test_unexpected_characters_tell_the_position(text: str, position: int) -> None:
    with pytest.raises(UnexpectedCharacters) as caught:
        parse_template(text)
    assert caught.value.position == position
    assert f"No terminal matches '{text[position]}'" in str(caught.value)
    assert f"at line 1 col {position + 1}" in str(caught.value)


def test_unexpected_characters_count_lines() -> None:
    with pytest.raises(UnexpectedCharacters) as caught:
        parse_template("one\ntwo $(var x )")
    assert (caught.value.line, caught.value.column) == (2, 13)
    assert str(caught.value).splitlines()[2:4] == ["two $(var x )", "            ^"]


@pytest.mark.parametrize(
    "text", ["$(", "$(var", "$(var ", "$(var x", "$(var 'x", r"$(var 'x\')", "a $(f $(g)"]
)
def test_text_that_ends_early(text: str) -> None:
    with pytest.raises(UnexpectedEOF, match="Unexpected end-of-input"):
        parse_template(text)


def test_the_rule_names_the_quotes_around_a_call() -> None:
    (outer,) = parse_template("""$(a '$(b)' "$(c)")""")
    assert isinstance(outer, SubstitutionCall)
    inner = [part for arg in outer.args for part in arg if isinstance(part, SubstitutionCall)]
    assert [outer.rule, *(part.rule for part in inner)] == [
        "substitution",
        "single_quoted_substitution",
        "double_quoted_substitution",
    ]


def test_called_names_include_those_in_arguments() -> None:
    assert list(called_names(parse_template("$(a $(b '$(c)'))$(d)"))) == ["a", "b", "c", "d"]


def nested(depth: int) -> str:
    return "$(var " * depth + "x" + ")" * depth


def test_deep_nesting_up_to_the_limit_parses() -> None:
    innermost = parse_template(nested(MAX_NESTING))
    for _ in range(MAX_NESTING):
        (found,) = innermost
        assert isinstance(found, SubstitutionCall) and found.name == "var"
        (innermost,) = found.args
    assert innermost == ("x",)


def test_excessive_nesting_is_an_error_and_no_recursion() -> None:
    with pytest.raises(TemplateSyntaxError, match=f"more than {MAX_NESTING} deep"):
        parse_template(nested(50_000))


GRAMMAR_TEXT = st.lists(
    st.sampled_from(["$(", *"() '\"\\$a1é\n\t", "b-c", "$(v ", "$(v '"]),
    max_size=30,
).map("".join)


@given(st.one_of(st.text(), GRAMMAR_TEXT))
@example("$(v '\\\\')")
def test_any_text_parses_or_is_refused(text: str) -> None:
    try:
        template = parse_template(text)
    except TemplateSyntaxError as error:
        assert error.template == text
    else:
        assert template


@given(st.text())
def test_unescape_undoes_doubling(text: str) -> None:
    assert unescape(text.replace("\\", "\\\\")) == text


def test_a_megabyte_is_scanned_in_linear_time() -> None:
    # Quadratic behaviour would take minutes here; the bound is no benchmark.
    begin = time.process_time()
    for text in ("$(var x)" * 50_000, "$(var '" + "a b\\'" * 100_000 + "')", "\\" * 500_000 + "$(v)"):
        parse_template(text)
    assert time.process_time() - begin < 20
