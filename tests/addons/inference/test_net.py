"""The net: what the analysis did not evaluate for some caller is a gap, unless literals in the text forbid it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from enclave_addons.inference import InferredSystem, analysis
from enclave_addons.inference.values import ANY, FunctionValue, Value

pytestmark = pytest.mark.usefixtures("no_cache")

Infer = Callable[..., InferredSystem]
PROGRAM = """
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import String
    {before}
    class N(Node):
        def __init__(self, kind='plain', loud=False):
            super().__init__('n')
            self.kind = kind
            {body}
        def make(self, name):
            self.create_publisher(String, name, 10)
    def main():
        rclpy.init()
        {main}
    if __name__ == '__main__':
        main()
    """


def _gaps(infer: Infer, body: str, main: str = "N()", before: str = "pass") -> list[str]:
    gap_lines = infer(PROGRAM.format(body=body, main=main, before=before))
    return [gap.why for gap in gap_lines.gaps]


@pytest.mark.parametrize("body", ["self.make('a') if False else None", "0 and self.make('a')"])
def test_what_literals_forbid_is_no_gap(body: str, infer: Infer) -> None:
    assert not _gaps(infer, body)


@pytest.mark.parametrize(
    ("body", "main"),
    [
        ("self.make('a') if loud else None", "N(loud=0 * 1)"),
        ("self.make('a') if loud else None", "N(**{'loud': False})"),
        ("self.make('a') if loud else None", "N('plain', False)"),
        ("loud = not True; self.make('a') if loud else None", "N()"),
        ("self.make('a') if self.kind == 'other' else None", "N()"),
        ("self.make('a') if DEBUG else None", "N()"),
        ("[self.make(each) for each in list(())]", "N()"),
    ],
)
def test_what_only_values_forbid_is_a_gap(body: str, main: str, infer: Infer) -> None:
    assert any("make() was not reached" in why for why in _gaps(infer, body, main, "DEBUG = False"))


@pytest.mark.parametrize(
    ("body", "main"),
    [
        ("self.make('a') if loud else None", "N()"),
        ("self.make('a') if loud else None", "N('other', loud=False)"),
        ("if not loud:\n                return\n            self.make('a')", "N(loud=True)"),
        ("self.make('a') if kind == 'other' else None", "N()"),
        ("self.make('a') if kind is not None else None", "N(kind=None)"),
    ],
)
def test_what_a_parameter_that_is_a_literal_forbids_is_no_gap(body: str, main: str, infer: Infer) -> None:
    assert not _gaps(infer, body, main)


def test_a_literal_of_one_caller_says_nothing_of_another(infer: Infer) -> None:
    """The second caller's value is unknown to the text, and False."""
    body = "self.make('a') if loud else None"
    gaps = _gaps(infer, body, "N(loud=False)\n        N(loud=0 * 1)")
    (why,) = [each for each in gaps if "was not reached" in each]
    first = 1 + next(at for at, text in enumerate(PROGRAM.split("\n")) if "{main}" in text)
    assert f"where __init__ is called at main.py:{first + 1}" in why


@pytest.mark.parametrize("test", ["typing.TYPE_CHECKING", "TYPE_CHECKING"])
def test_what_only_a_type_checker_reads_is_no_gap(test: str, infer: Infer) -> None:
    before = f"import typing\n    from typing import TYPE_CHECKING\n    if {test}:\n        import makes_interfaces"
    other = (
        "import rclpy\nif __name__ == '__main__':\n    rclpy.create_node('m').create_publisher(int, 'a', 1)"
    )
    files = {"makes_interfaces.py": other}
    assert not infer(PROGRAM.format(body="pass", main="N()", before=before), files).gaps
    run_time = before.replace(f"if {test}", "DEBUG = False\n    if DEBUG")
    (gap,) = infer(PROGRAM.format(body="pass", main="N()", before=run_time), files).gaps
    assert "the module makes_interfaces was not followed" in gap.why


def test_each_caller_counts_for_itself(infer: Infer) -> None:
    body = "self.make('a') if self.kind == 'loud' else None"
    assert not _gaps(infer, body, "N('loud')")
    (why,) = _gaps(infer, body, "N('loud'); N('quiet')")
    assert "make() was not reached where __init__ is called at main.py" in why


def test_a_function_that_is_referred_to_and_never_entered_is_a_gap(infer: Infer) -> None:
    before = "def helper(node): node.create_client(String, 'c')\n    TABLE = {'f': helper}"
    assert any("helper may be called" in why for why in _gaps(infer, "pass", "N()", before))
    assert not _gaps(infer, "pass", "N()", "def helper(node): node.create_client(String, 'c')")


def test_it_does_not_believe_the_interpreter(infer: Infer, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interpreter that skips every second statement is found out."""
    kind = next(each for each in analysis.TABLES.statements if each.__name__ == "Expr")
    really = analysis.TABLES.statements[kind]

    def skip(run: object, node: object, frame: object) -> bool:
        return getattr(node, "lineno", 0) % 2 == 0 or bool(really(run, node, frame))  # type: ignore[arg-type]

    monkeypatch.setitem(analysis.TABLES.statements, kind, skip)
    body = "self.make('a')\n            self.make('b')\n            self.make('c')"
    assert sum("was not reached" in why for why in _gaps(infer, body)) >= 1


ONE_CALL = """
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import String
    class N(Node):
        def __init__(self, name):
            super().__init__(name)
            self.make(name)
        def make(self, name):
            self.create_publisher(String, name, 10)
    def main():
        rclpy.init()
        N('first')
        N('second')
    if __name__ == '__main__':
        main()
    """


@pytest.mark.parametrize("which", [1, 2])
def test_a_place_that_one_run_of_its_function_reached_and_another_lost_is_a_gap(
    which: int, infer: Infer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both runs of ``make`` are entered by the same call."""
    assert not infer(ONE_CALL).gaps
    kind = next(each for each in analysis.TABLES.statements if each.__name__ == "Expr")
    really = analysis.TABLES.statements[kind]
    left = [which]

    def lose_one(run: object, node: object, frame: object) -> bool:
        left[0] -= getattr(node, "lineno", 0) == 10
        lost, left[0] = left[0] == 0, left[0] or -1
        return lost or bool(really(run, node, frame))  # type: ignore[arg-type]

    monkeypatch.setitem(analysis.TABLES.statements, kind, lose_one)
    (gap,) = infer(ONE_CALL).gaps
    assert "create_publisher() was not reached where make is called at main.py:8" in gap.why


def test_a_call_of_what_hands_a_creating_function_on_counts(
    infer: Infer, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = "def setup(node): node.create_timer(1, lambda: make_more(node))\n"
    before += "    def make_more(node): node.create_client(String, 'c')"
    assert not _gaps(infer, "setup(self)", before=before)
    kind = next(each for each in analysis.TABLES.callables if each.__name__ == "FunctionValue")
    really = analysis.TABLES.callables[kind]

    def lose_setup(run: object, function: FunctionValue, call: object) -> Value:
        return ANY if function.name == "setup" else really(run, function, call)  # type: ignore[arg-type]

    monkeypatch.setitem(analysis.TABLES.callables, kind, lose_setup)
    assert any(
        "setup() is called on something that is not understood" in why
        for why in _gaps(infer, "setup(self)", before=before)
    )


@pytest.mark.parametrize(
    ("body", "main", "is_gap"),
    [
        ("pass", "N().on_set(); print({*set([1])}, 0 and set([1]))", False),
        ("pass", "N().on_set(); from threading import Event; Event().set()", False),
        ("pass", "N().on_set(); from elsewhere import make; make().set()", True),
        ("self.kind == 'other' and self.set()", "N()", True),
    ],
)
def test_a_method_is_not_meant_by_a_name_alone(body: str, main: str, is_gap: bool, infer: Infer) -> None:
    """``set`` creates as a method; ``set(...)`` is Python's own, and so is ``set`` of an event."""
    methods = "def set(self):\n            self.make('a')\n        def on_set(self):\n            self.set()"
    program = PROGRAM.replace("def make(", f"{methods}\n        def make(")
    gaps = infer(program.format(body=body, main=main, before="pass")).gaps
    assert any("set() " in gap.why for gap in gaps) is is_gap


SETTINGS = {
    "numpy.float = float": 0,
    "numpy.float = getattr": 1,
    "numpy.float = N": 1,
    "torch.backends.cudnn.benchmark = True": 0,
    "torch.relu = rclpy.create_node": 1,
    "json.dumps = None": 1,
}


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_setting_of_a_library_is_no_gap_and_a_function_put_into_it_is(setting: str, infer: Infer) -> None:
    found = _gaps(infer, "pass", before=f"import json, numpy, torch\n    class N: pass\n    {setting}")
    assert len([why for why in found if "is replaced" in why]) == SETTINGS[setting]
